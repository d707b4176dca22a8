"""What a ROS 1 bag says of its connections: in its chunks, and in the index at its end."""

from __future__ import annotations

from likeme_bags.bag_warnings import About, Notes
from likeme_bags.ros1_format import Fields, fields_of, text_of, u32
from likeme_bags.storage import Channel


class Connections:
    """The connections of one bag; of one that is described in two ways nothing is believed."""

    def __init__(self, file: str, notes: Notes) -> None:
        """file: its name, for notes."""
        self._file, self._notes = file, notes
        self.channels: dict[int, Channel] = {}
        # Those that are described twice, and differently.
        self._doubtful: set[int] = set()
        # Those that a chunk describes, rather than the index alone.
        self._confirmed: set[int] = set()

    def take(self, fields: Fields, body: bytes, in_chunk: bool) -> None:
        """Note a connection record."""
        key = u32(fields, 'conn')
        more = fields_of(memoryview(body))
        latched = more.get('latching') == b'1'
        channel = Channel(
            text_of(fields, 'topic'),
            text_of(more, 'type'),
            'ros1',
            'latched' if latched else '',
            text_of(more, 'message_definition'),
            'ros1msg',
            text_of(more, 'md5sum'),
        )
        known = self.channels.setdefault(key, channel)
        if (known.topic, known.type, known.definition) != (*channel[:2], channel.definition):
            self._doubtful.add(key)
        if in_chunk:
            self._confirmed.add(key)

    def drop_doubtful(self, vouched: bool) -> None:
        """Messages whose topic or type is in doubt are not passed on: they lose their channel.

        vouched: nothing in the file is wrong, so that its index is believed, too.
        """
        if not vouched:
            # The index at the end has no checksum, and something in this file is wrong.
            for key in sorted(self.channels.keys() - self._confirmed - self._doubtful):
                name = self.channels.pop(key).topic
                self._notes.remark(
                    About.TOPICS,
                    f'{self._file} is damaged, and nothing vouches for what it says of topic '
                    f'{name}.',
                )
        for key in sorted(self._doubtful):
            topic = self.channels.pop(key).topic
            self._notes.lost(
                self._file, f'connection {key} ({topic}) is described twice and differently'
            )

"""What an MCAP file says of its topics: in its summary, and beside the messages themselves."""

from __future__ import annotations

from typing import TypeVar

from likeme_bags.bag_warnings import About, Notes
from likeme_bags.mcap_format import ChannelRecord, ChunkContent, Schema
from likeme_bags.mcap_scan import Layout
from likeme_bags.storage import Channel

T = TypeVar('T')


class McapTopics:
    """Schemas and channels of a file; what stands in a chunk counts more than the summary."""

    def __init__(self, file: str, layout: Layout, notes: Notes) -> None:
        """file: its name, for notes."""
        self._file, self._notes = file, notes
        self._schemas: dict[int, Schema] = dict(layout.schemas)
        self._records: dict[int, ChannelRecord] = dict(layout.channels)
        # Those that a chunk describes, rather than the summary alone.
        self._confirmed_schemas: set[int] = set()
        self._confirmed_channels: set[int] = set()

    def learn(self, content: ChunkContent) -> None:
        """Keep what a chunk says: unlike the summary, it may stand under a checksum."""
        self._confirmed_schemas |= content.schemas.keys()
        self._confirmed_channels |= content.channels.keys()
        for key, schema in content.schemas.items():
            self._learn(self._schemas, key, schema)
        for key, record in content.channels.items():
            self._learn(self._records, key, record)

    def channels(self, vouched: bool) -> dict[int, Channel]:
        """All topics; those alone that a chunk describes unless `vouched` for the summary."""
        found = {}
        for key, record in self._records.items():
            if vouched or (
                key in self._confirmed_channels and record.schema in self._confirmed_schemas
            ):
                found[key] = self._channel(record)
            else:
                self._notes.remark(
                    About.CHUNKS,
                    f'{self._file} is damaged, and nothing vouches for what it says of topic '
                    f'{record.topic}.',
                )
        return found

    def _learn(self, known: dict[int, T], key: int, new: T) -> None:
        if known.get(key, new) != new:
            self._notes.remark(
                About.CHUNKS,
                f'{self._file}: topic or type {key} is described twice and differently; '
                'what stands with the messages counts.',
            )
        known[key] = new

    def _channel(self, record: ChannelRecord) -> Channel:
        schema = self._schemas.get(record.schema, Schema('', '', ''))
        more = dict(record.metadata)
        return Channel(
            record.topic,
            schema.name,
            record.encoding,
            more.get('offered_qos_profiles', ''),
            schema.text,
            schema.encoding if schema.text else '',
            more.get('topic_type_hash', ''),
        )

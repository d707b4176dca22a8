"""Header stamps of messages, read without decoding the rest."""

from __future__ import annotations

import struct

from rosbags.interfaces import Nodetype

from likeme_bags.errors import DamagedError, UnsupportedError
from likeme_bags.typestores import typestore_of
from likeme_bags.values import Topic

_STAMP = {0: struct.Struct('>iI'), 1: struct.Struct('<iI')}


def has_header(topic: Topic) -> bool:
    """Whether a topic's messages begin with a std_msgs/Header, as far as its type is known."""
    try:
        fields = typestore_of(topic).fielddefs[topic.type][1]
    except UnsupportedError:
        return False
    return bool(fields) and fields[0][1] == (Nodetype.NAME, 'std_msgs/msg/Header')


def header_stamp(data: bytes) -> int:
    """The header's stamp, ns, of a message that begins with one.

    Raises:
        DamagedError: the message is too short for it.
    """
    if len(data) < 12:
        raise DamagedError(f'Expected a header, got {len(data)} bytes.')
    seconds, nanoseconds = _STAMP[data[1] & 1].unpack_from(data, 4)
    return int(seconds * 10**9 + nanoseconds)

"""Message types: from the definitions in a bag where it has them, else Jazzy's own."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import lru_cache

from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from likeme_bags.errors import LIBRARY_ERRORS, BagError, DamagedError
from likeme_bags.limits import MAX_BLOCK
from likeme_bags.values import Topic

TYPE_NAME = re.compile(r'[A-Za-z]\w*/(msg|srv|action)/[A-Za-z]\w*', re.ASCII)
_SEPARATOR = '=' * 80 + '\n'
_MAX_DEFINITION = 2**20


@lru_cache(maxsize=1)
def jazzy() -> Typestore:
    """The types that come with ROS 2 Jazzy."""
    return get_typestore(Stores.ROS2_JAZZY)


def full_name(type_name: str) -> str:
    """'sensor_msgs/msg/Image' from that or from the old 'sensor_msgs/Image'.

    Raises:
        DamagedError: it is neither.
    """
    if type_name.count('/') == 1:
        type_name = type_name.replace('/', '/msg/')
    if not TYPE_NAME.fullmatch(type_name):
        raise DamagedError(f"Expected a type as package/msg/Name, got '{type_name[:60]}'.")
    return type_name


def typestore_of(topic: Topic) -> Typestore:
    """A store that knows the topic's type.

    Raises:
        DamagedError: neither the bag nor Jazzy defines it.
    """
    if topic.definition:
        return _defined(topic.type, topic.definition, topic.encoding)
    if topic.type not in jazzy().fielddefs:
        raise DamagedError(f'Expected a definition of {topic.type} ({topic.name}), got none.')
    return jazzy()


@lru_cache(maxsize=256)
def _defined(name: str, text: str, encoding: str) -> Typestore:
    if len(text) > _MAX_DEFINITION:
        raise DamagedError(f'Expected a definition of {name}, got {len(text)} bytes.')
    store = get_typestore(Stores.EMPTY)
    store.max_sequence_length = MAX_BLOCK
    try:
        if encoding == 'ros2idl':
            for part in text.split(_SEPARATOR):
                body = part.partition('\n')[2] if part.startswith('IDL: ') else part
                if body.strip():
                    store.register(get_types_from_idl(body))
        else:
            store.register(get_types_from_msg(text, name))
        store.get_msgdef(name)
    except LIBRARY_ERRORS as error:
        raise DamagedError(
            f'Expected a definition of {name}, got one that does not parse: {error}'
        ) from None
    return store


@lru_cache(maxsize=1024)
def _layout(name: str, text: str, encoding: str) -> str:
    try:
        return typestore_of(Topic('', name, 0, (), text, encoding)).hash_rihs01(name)
    except (*LIBRARY_ERRORS, BagError):
        return text


def layout(topic: Topic) -> str:
    """Equal for two definitions of a type with the same fields in the same order.

    The RIHS01 hash by the definition itself; the definition where it does not parse, maybe ''.
    """
    return _layout(topic.type, topic.definition, topic.encoding)


def described(name: str) -> tuple[str, str]:
    """Definition text and hash of a type of Jazzy; ('', '') when it is not one."""
    store = jazzy()
    if name not in store.fielddefs:
        return '', ''
    return store.generate_msgdef(name, ros_version=2)[0], store.hash_rihs01(name)


def decode(topic: Topic, data: bytes) -> object:
    """A message as an object with the fields of its type.

    Raises:
        DamagedError: the bytes are not such a message.
    """
    try:
        return typestore_of(topic).deserialize_cdr(data, topic.type)
    except DamagedError:
        raise
    except (*LIBRARY_ERRORS, MemoryError) as error:
        if topic.definition and topic.type in jazzy().fielddefs:
            # Some tools embed definitions that are cut short.
            return decode(replace(topic, definition=''), data)
        raise DamagedError(f'Expected a {topic.type} on {topic.name}: {error}') from None

"""From ROS 1 messages to CDR of the ROS 2 type of the same name."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache, partial

from rosbags.convert.converter import (
    STATIC_MSGTYPE_RENAMES,
    is_same_wireformat,
    migrate_bytes,
)
from rosbags.interfaces.typing import Typesdict
from rosbags.typesys import Stores, get_typestore
from rosbags.typesys.store import Typestore

from likeme_bags.errors import LIBRARY_ERRORS, BagError, DamagedError
from likeme_bags.limits import MAX_BLOCK
from likeme_bags.typestores import full_name, jazzy, parsed_definition

_HEADER = 'std_msgs/msg/Header'
_MAX_DEFINITION = 2**20


class Ros1Type:
    """Turns messages of one ROS 1 connection into CDR.

    Where ROS 2 lays a message out differently (`sensor_msgs/Range` and the like), fields
    are carried over by name and new ones are zero. ROS 1 types that ROS 2 does not have stay as
    they are, without `seq` in their headers.
    """

    def __init__(self, kind: str, definition: str) -> None:
        source = full_name(kind)
        self.name = STATIC_MSGTYPE_RENAMES.get(source, source)
        # Whether fields had to be carried over one by one.
        self.migrated = False
        try:
            self._convert, store = self._converter(source, definition)
            self.definition = store.generate_msgdef(self.name, ros_version=2)[0]
            self.type_hash = store.hash_rihs01(self.name)
        except LIBRARY_ERRORS as error:
            raise DamagedError(f'Expected a definition of {source}: {error}') from None

    def _converter(
        self, source: str, definition: str
    ) -> tuple[Callable[[bytes | memoryview], memoryview], Typestore]:
        if len(definition) > _MAX_DEFINITION:
            raise DamagedError(f'Expected a definition of {source}, got {len(definition)} bytes.')
        store = get_typestore(Stores.EMPTY)
        store.max_sequence_length = MAX_BLOCK
        store.register(parsed_definition(source, definition, 'ros1msg'))
        store.get_msgdef(source)
        target = jazzy()
        if self.name not in target.fielddefs:
            target = _without_seq(store, source, self.name)
        if is_same_wireformat(store, target, source, self.name):
            return partial(target.ros1_to_cdr, typename=self.name), target
        self.migrated = True
        cache: dict[str, object] = {}
        return (
            lambda raw: migrate_bytes(
                store, target, source, self.name, cache, raw, src_is2=False, dst_is2=True
            )
        ), target

    def cdr(self, data: bytes) -> bytes:
        """One message.

        Raises:
            BagError: it is not of this type, or says what ROS 2's type cannot hold.
        """
        try:
            return bytes(self._convert(data))
        except (*LIBRARY_ERRORS, MemoryError) as error:
            raise BagError(f'Expected a {self.name}: {error}') from None


def _without_seq(store: Typestore, source: str, name: str) -> Typestore:
    """The same types as ROS 2 would have them: headers without their sequence number."""
    types: Typesdict = {key: value for key, value in store.fielddefs.items() if key != _HEADER}
    if name != source:
        types[name] = types.pop(source)
    types[_HEADER] = jazzy().fielddefs[_HEADER]
    result = get_typestore(Stores.EMPTY)
    result.register(types)
    return result


@lru_cache(maxsize=256)
def ros1_type(kind: str, definition: str) -> Ros1Type:
    """The type with this name and definition, made once: making one generates code.

    Raises:
        DamagedError: the definition cannot be used.
    """
    return Ros1Type(kind, definition)

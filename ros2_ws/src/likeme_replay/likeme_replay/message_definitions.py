"""Message definitions by type name: ROS's own from `rosbags`, others from installed packages."""

from __future__ import annotations

import re
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

from ament_index_python.packages import PackageNotFoundError, get_package_share_directory
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from likeme_bags.errors import LIBRARY_ERRORS
from likeme_bags.typestores import decode, layout
from likeme_bags.values import Topic


class UnknownTypeError(ValueError):
    """No installed package defines a type."""


class Definition(NamedTuple):
    """The definition that a bag embeds: the text with all nested types, and the RIHS01 hash."""

    text: str
    digest: str


class Definitions:
    """A type store that loads message packages when they are first needed."""

    def __init__(self) -> None:
        self.store: Typestore = get_typestore(Stores.ROS2_JAZZY)
        self._read: set[str] = set()
        self._digests: dict[str, str] = {}

    def of(self, msgtype: str) -> Definition:
        """The definition of 'package/msg/Name'.

        Raises:
            UnknownTypeError: no installed package has it.
        """
        self.load(msgtype)
        text, _ = self.store.generate_msgdef(msgtype, ros_version=2)
        return Definition(text, self.store.hash_rihs01(msgtype))

    def load(self, msgtype: str) -> None:
        """Load a type, so that it can be read and written.

        Raises:
            UnknownTypeError: no installed package has it.
        """
        if msgtype not in self.store.fielddefs:
            self._read_package(msgtype.partition('/')[0])
        if msgtype not in self.store.fielddefs:
            raise UnknownTypeError(
                f'Expected a message type of an installed package, got {msgtype!r}.'
            )

    def read(self, data: bytes, msgtype: str) -> Any:
        """The message in CDR bytes.

        Raises:
            ValueError: they do not fit the type, or the type is not installed.
        """
        self.load(msgtype)
        try:
            # A view avoids a copy of the image.
            return self.store.deserialize_cdr(memoryview(data), msgtype)
        except LIBRARY_ERRORS:
            raise ValueError(f'Expected a {msgtype}, got {len(data)} other bytes.') from None

    def _is_older(self, topic: Topic) -> bool:
        """Whether a bag's topic was recorded with other fields than its type has here."""
        if not topic.definition:
            return False
        if topic.type not in self._digests:
            self._digests[topic.type] = self.of(topic.type).digest
        return layout(topic) != self._digests[topic.type]

    def read_recorded(self, topic: Topic, data: bytes) -> Any:
        """The message in CDR bytes of a bag's topic, with the fields that it was recorded with.

        Raises:
            ValueError, BagError: they do not fit the type, or the type is not installed.
        """
        if self._is_older(topic):
            return decode(topic, data)
        return self.read(data, topic.type)

    def write(self, message: Any) -> bytes:
        """The CDR bytes of a message."""
        return bytes(self.store.serialize_cdr(message, message.__msgtype__))

    def make(self, msgtype: str, **fields: Any) -> Any:
        """A message; every field is required."""
        self.load(msgtype)
        return self.store.types[msgtype](**fields)

    def _read_package(self, package: str) -> None:
        if package in self._read:
            return
        self._read.add(package)
        try:
            folder = Path(get_package_share_directory(package)) / 'msg'
        except (PackageNotFoundError, ValueError):
            return
        texts = {f'{package}/msg/{p.stem}': p.read_text('utf-8') for p in folder.glob('*.msg')}
        for text in texts.values():
            for other in re.findall(r'^\s*(\w+)/\w+', text, re.MULTILINE):
                if not any(name.startswith(f'{other}/') for name in self.store.fielddefs):
                    self._read_package(other)
        known = {
            n: d for name, text in texts.items() for n, d in get_types_from_msg(text, name).items()
        }
        self.store.register({n: d for n, d in known.items() if n not in self.store.fielddefs})


@lru_cache(maxsize=1)
def definitions() -> Definitions:
    """The store of this process."""
    return Definitions()

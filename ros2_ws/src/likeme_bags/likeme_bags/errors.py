"""What this package raises, and what it catches."""

from __future__ import annotations

import struct

from rosbags.rosbag2 import ReaderError, WriterError
from rosbags.serde import SerdeError
from rosbags.typesys import TypesysError

# What the rosbags library raises on texts and bytes that are not what it expects: its parsers and
# generated decoders were written for whole files.
LIBRARY_ERRORS = (
    ReaderError,
    WriterError,
    SerdeError,
    TypesysError,
    ArithmeticError,
    AssertionError,
    AttributeError,
    LookupError,
    RecursionError,
    SyntaxError,
    TypeError,
    ValueError,
    struct.error,
)


class BagError(Exception):
    """A bag, or a message in it, cannot be used; the text is one sentence for a person."""


class UnsupportedError(BagError):
    """A valid definition or image format that this package cannot decode; the bag is whole."""


class DamagedError(BagError):
    """Bytes that do not say what the format promises; caught where the rest can still be read."""

"""What this package raises, and what it catches."""

from __future__ import annotations

import sqlite3
import struct

import apsw
from backports import zstd
from rosbags.rosbag1 import ReaderError as Ros1ReaderError
from rosbags.rosbag2 import ReaderError, WriterError
from rosbags.serde import SerdeError
from rosbags.typesys import TypesysError

# What the rosbags library raises on texts and bytes that are not what it expects: its parsers and
# generated decoders were written for whole files.
LIBRARY_ERRORS = (
    ReaderError,
    Ros1ReaderError,
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


# What reading a storage file through the library may raise.
READ_ERRORS = (
    DamagedError,
    *LIBRARY_ERRORS,
    EOFError,
    MemoryError,
    OSError,
    RuntimeError,
    apsw.Error,
    sqlite3.Error,
    zstd.ZstdError,
)

"""Compression of whole files and of single messages by rosbag2, told by their first bytes."""

from __future__ import annotations

import bz2
import gzip
import shutil
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import IO, Any

import lz4.frame
from backports import zstd

from likeme_bags.bag_warnings import BagWarnings, Subject
from likeme_bags.compression import decompress_all
from likeme_bags.errors import BagError, DamagedError
from likeme_bags.limits import MAX_BLOCK, MAX_UNPACKED

_STEP = 4 * 2**20
# Disk space that is left alone, bytes.
_SPARE = 2**30
# How a compressed file begins, and what opens it. No storage file and no CDR message begins so.
_OPENERS: Mapping[bytes, tuple[str, Callable[..., IO[bytes]]]] = {
    b'\x28\xb5\x2f\xfd': ('zstd', zstd.open),
    b'\x04\x22\x4d\x18': ('lz4', lz4.frame.open),
    b'BZh': ('bz2', bz2.open),
    b'\x1f\x8b': ('gzip', gzip.open),
}
# Endings that compressed files have.
ENDINGS = ('.zstd', '.zst', '.lz4', '.bz2', '.gz')


def without_ending(name: str) -> str:
    """A file's name before it was compressed."""
    return next((name.removesuffix(end) for end in ENDINGS if name.endswith(end)), name)


def compression_of(begin: bytes) -> str:
    """'zstd', 'lz4', 'bz2', 'gzip', or '' by the first bytes."""
    return next((name for magic, (name, _) in _OPENERS.items() if begin.startswith(magic)), '')


def decompress_file(packed: Path, folder: Path, log: BagWarnings) -> Path:
    """Decompress as far as it goes; what is cut or damaged is warned of, a bomb is refused.

    Raises:
        BagError: nothing comes out, or more than there is room for.
    """
    target = folder / without_ending(packed.name)
    room = min(MAX_UNPACKED, shutil.disk_usage(folder).free - _SPARE)
    with packed.open('rb') as file:
        method = compression_of(file.read(4))
    opener: Any = dict(_OPENERS.values()).get(method)
    if opener is None:
        raise BagError(f'Expected a file compressed by zstd, lz4, bz2 or gzip, got {packed.name}.')
    written = 0
    try:
        with opener(packed, 'rb') as source, target.open('wb') as sink:
            while data := source.read1(_STEP):
                written += len(data)
                if written > room:
                    raise BagError(f'{packed.name} unpacks to more than {room} bytes.')
                sink.write(data)
    except (zstd.ZstdError, EOFError, RuntimeError, ValueError, OSError) as error:
        sentence = f'{packed.name} is damaged after {written} unpacked bytes: {error}.'
        log.loss(Subject.FILES, sentence)
    if not written:
        raise BagError(f'Expected a file compressed by {method}, got nothing of {packed.name}.')
    return target


def decompress_message(data: bytes) -> bytes:
    """A message as it was before rosbag2 compressed it; CDR, which begins with 0, as it is.

    Raises:
        DamagedError: it does not unpack, or to more than a message can be.
    """
    if not data or data[0] == 0:
        return data
    method = compression_of(data[:4])
    if method not in ('zstd', 'lz4', 'bz2'):
        raise DamagedError(f'Expected CDR, or a message compressed by zstd, got {data[:4]!r}.')
    return decompress_all(data, method, MAX_BLOCK)

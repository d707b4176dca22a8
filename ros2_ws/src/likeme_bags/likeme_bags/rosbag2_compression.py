"""Compression of whole files and of single messages by rosbag2, told by their first bytes."""

from __future__ import annotations

import shutil
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import BinaryIO

from likeme_bags.bag_warnings import BagWarnings, Subject
from likeme_bags.compression import DECOMPRESSION_ERRORS, decompress_all, decompressor
from likeme_bags.errors import BagError, DamagedError
from likeme_bags.limits import MAX_BLOCK, MAX_UNPACKED

_STEP = 2**20
# Disk space that is left alone, bytes.
_SPARE = 2**30
# How compressed data begins. No storage file and no CDR message does.
_MAGIC: Mapping[bytes, str] = {
    b'\x28\xb5\x2f\xfd': 'zstd',
    b'\x04\x22\x4d\x18': 'lz4',
    b'BZh': 'bz2',
}
# Endings that compressed files have.
ENDINGS = ('.zstd', '.zst', '.lz4', '.bz2')


def without_ending(name: str) -> str:
    """A file's name before it was compressed."""
    return next((name.removesuffix(end) for end in ENDINGS if name.endswith(end)), name)


def compression_of(begin: bytes) -> str:
    """'zstd', 'lz4', 'bz2' or '' by the first bytes."""
    return next((name for magic, name in _MAGIC.items() if begin.startswith(magic)), '')


def decompress_file(packed: Path, folder: Path, log: BagWarnings) -> Path:
    """Decompress as far as it goes; what is cut or damaged is warned of, a bomb is refused.

    Raises:
        BagError: nothing comes out, or more than there is room for.
    """
    target = folder / without_ending(packed.name)
    room = min(MAX_UNPACKED, shutil.disk_usage(folder).free - _SPARE)
    written = 0
    try:
        with packed.open('rb') as source, target.open('wb') as sink:
            for part in _decompressed(source):
                written += len(part)
                if written > room:
                    raise BagError(f'{packed.name} unpacks to more than {room} bytes.')
                sink.write(part)
    except (DamagedError, *DECOMPRESSION_ERRORS) as error:
        sentence = f'{packed.name} is damaged after {written} unpacked bytes: {error}'
        log.loss(Subject.FILES, sentence)
    if not written:
        raise BagError(f'Expected a compressed bag, got nothing out of {packed.name}.')
    return target


def _decompressed(source: BinaryIO) -> Iterator[bytes]:
    """Part by part what one compressed stream after the other unpacks to."""
    data = source.read(_STEP)
    method = compression_of(data)
    machine = decompressor(method)
    while data:
        if machine.eof:
            machine = decompressor(method)
        yield machine.decompress(data, _STEP)
        while not (machine.eof or machine.needs_input):
            yield machine.decompress(b'', _STEP)
        data = (machine.eof and machine.unused_data) or source.read(_STEP)
    if not machine.eof:
        raise DamagedError('it ends before its compressed stream does.')


def decompress_message(data: bytes) -> bytes:
    """A message as it was before rosbag2 compressed it; CDR, which begins with 0, as it is.

    Raises:
        DamagedError: it does not unpack, or to more than a message can be.
    """
    if not data or data[0] == 0:
        return data
    method = compression_of(data[:4])
    if not method:
        raise DamagedError(f'Expected CDR, or a message compressed by zstd, got {data[:4]!r}.')
    return decompress_all(data, method, MAX_BLOCK)

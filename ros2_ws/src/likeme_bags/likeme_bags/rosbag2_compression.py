"""Files that were compressed as a whole (`.zstd`), unpacked into a temporary folder."""

from __future__ import annotations

import shutil
from pathlib import Path

from backports import zstd

from likeme_bags.bag_warnings import About, Notes
from likeme_bags.errors import BagError, DamagedError
from likeme_bags.limits import MAX_BLOCK, MAX_UNPACKED

_STEP = 4 * 2**20
# Disk space that is left alone, bytes.
_SPARE = 2**30


def unpack_file(packed: Path, folder: Path, notes: Notes) -> Path:
    """Unpack as far as it goes; a cut is noted, a bomb is refused.

    Raises:
        BagError: nothing comes out, or more than there is room for.
    """
    target = folder / packed.name.removesuffix('.zstd')
    room = min(MAX_UNPACKED, shutil.disk_usage(folder).free - _SPARE)
    machine, written = zstd.ZstdDecompressor(), 0
    try:
        with packed.open('rb') as source, target.open('wb') as sink:
            while not machine.eof:
                data = source.read(_STEP) if machine.needs_input else b''
                if machine.needs_input and not data:
                    notes.loss(
                        About.FILES, f'{packed.name} ends before its compressed stream does.'
                    )
                    break
                part = machine.decompress(data, _STEP)
                written += len(part)
                if written > room:
                    raise BagError(f'{packed.name} unpacks to more than {room} bytes.')
                sink.write(part)
    except zstd.ZstdError as error:
        notes.loss(
            About.FILES, f'{packed.name} is damaged after {written} unpacked bytes: {error}.'
        )
    except OSError as error:
        raise BagError(f'Cannot unpack {packed.name}: {error.strerror}.') from None
    if not written:
        raise BagError(f'Expected a file compressed by zstd, got {packed.name}.')
    return target


def unpack_message(data: bytes) -> bytes:
    """A message that was compressed by itself.

    Raises:
        DamagedError: it does not unpack, or to more than a message can be.
    """
    machine = zstd.ZstdDecompressor()
    try:
        result = machine.decompress(data, MAX_BLOCK)
    except zstd.ZstdError as error:
        raise DamagedError(f'Expected a message compressed by zstd: {error}.') from None
    if not machine.eof:
        raise DamagedError(f'Expected a whole compressed message, got {len(result)} bytes of it.')
    return result

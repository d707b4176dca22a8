"""Decompression that never makes more than it was told to expect."""

from __future__ import annotations

import bz2
from typing import Any

import lz4.frame
from backports import zstd

from likeme_bags.errors import DamagedError
from likeme_bags.limits import MAX_BLOCK

# Asked for in steps, so that a cut stream still gives what came before the cut.
_STEP = 2**20
DECOMPRESSION_ERRORS = (zstd.ZstdError, RuntimeError, OSError, ValueError, EOFError, MemoryError)


def decompress(data: bytes, method: str, size: int) -> bytes:
    """Exactly `size` bytes; `method` is '' (or 'none'), 'zstd', 'lz4' or 'bz2'.

    Raises:
        DamagedError: another size comes out, or nothing at all. Nothing beyond `size` is produced.
    """
    if size > MAX_BLOCK:
        raise DamagedError(f'Expected at most {MAX_BLOCK} bytes in one block, got {size}.')
    result = data if method in ('', 'none') else decompress_all(data, method, size)
    if len(result) != size:
        raise DamagedError(f'Expected {size} bytes after decompression, got {len(result)}.')
    return result


def decompress_all(data: bytes, method: str, most: int) -> bytes:
    """All that a stream unpacks to, at most `most` bytes.

    Raises:
        DamagedError: it is damaged, or unpacks to more.
    """
    machine = decompressor(method)
    try:
        # One byte too many tells that the stream goes on.
        result: bytes = machine.decompress(data, most + 1)
        while not machine.eof and len(result) <= most:
            if not (part := machine.decompress(b'', most + 1 - len(result))):
                break
            result += part
    except DECOMPRESSION_ERRORS as error:
        raise DamagedError(f'Expected data compressed by {method}: {error}') from None
    if len(result) > most or not machine.eof:
        raise DamagedError(
            f'Expected {most} bytes after decompression, got {len(result)} or more.'
        )
    return result


def decompress_prefix(data: bytes, method: str, size: int) -> bytes:
    """What a stream that was cut still gives: its beginning, at most `size` bytes, or none."""
    if method in ('', 'none') or size > MAX_BLOCK:
        return data[: min(size, MAX_BLOCK)]
    parts: list[bytes] = []
    made = 0
    try:
        machine = decompressor(method)
        part = machine.decompress(data, min(_STEP, size))
        while part:
            parts.append(part)
            made += len(part)
            part = b'' if machine.eof else machine.decompress(b'', min(_STEP, size - made))
    except (DamagedError, *DECOMPRESSION_ERRORS):
        pass
    return b''.join(parts)


def decompressor(method: str) -> Any:
    """An incremental decompressor.

    Raises:
        DamagedError: the method is none that is known.
    """
    known = {
        'zstd': zstd.ZstdDecompressor,
        'lz4': lz4.frame.LZ4FrameDecompressor,
        'bz2': bz2.BZ2Decompressor,
    }
    if method not in known:
        expected = ', '.join(known)
        raise DamagedError(f"Expected compression by {expected} or none, got '{method[:20]}'.")
    return known[method]()

"""Decompression that never makes more than it was told to expect."""

from __future__ import annotations

import bz2
from typing import Any, Protocol

import lz4.frame
from backports import zstd

from likeme_bags.errors import DamagedError
from likeme_bags.limits import MAX_BLOCK

# Asked for in steps, so that a cut stream still gives what came before the cut.
_STEP = 2**20


class _Decompressor(Protocol):
    """What bz2, lz4 and zstd have in common."""

    eof: bool
    needs_input: bool

    def decompress(self, data: bytes, max_length: int = -1) -> bytes: ...


def _decompressor(method: str) -> Any:
    if method == 'zstd':
        return zstd.ZstdDecompressor()
    if method == 'lz4':
        return lz4.frame.LZ4FrameDecompressor()
    if method == 'bz2':
        return bz2.BZ2Decompressor()
    raise DamagedError(f"Expected compression by zstd, lz4, bz2 or none, got '{method[:20]}'.")


def decompress(data: bytes | memoryview, method: str, size: int) -> bytes | memoryview:
    """Exactly `size` bytes; `method` is '' (or 'none'), 'zstd', 'lz4' or 'bz2'.

    Raises:
        DamagedError: another size comes out, or nothing at all. Nothing beyond `size` is produced.
    """
    if size > MAX_BLOCK:
        raise DamagedError(f'Expected at most {MAX_BLOCK} bytes in one block, got {size}.')
    if method in ('', 'none'):
        result: bytes | memoryview = data
    elif method == 'zstd' and _says_its_size(data, size):
        result = _at_once(data)
    else:
        result = _bounded(bytes(data), _decompressor(method), size)
    if len(result) != size:
        raise DamagedError(f'Expected {size} bytes after decompression, got {len(result)}.')
    return result


def _says_its_size(data: bytes | memoryview, size: int) -> bool:
    """Whether this is one zstd frame that promises just that size; then it gives no more."""
    try:
        return zstd.get_frame_info(data).decompressed_size == size and zstd.get_frame_size(
            data
        ) == len(data)
    except zstd.ZstdError:
        return False


def _at_once(data: bytes | memoryview) -> bytes:
    """Into a buffer of the right size from the start."""
    try:
        return zstd.decompress(data)
    except (zstd.ZstdError, MemoryError) as error:
        raise DamagedError(f'Expected data compressed by zstd: {error}') from None


def _bounded(data: bytes, machine: _Decompressor, size: int) -> bytes:
    """At most size + 1 bytes: one too many tells that the stream goes on."""
    try:
        result = machine.decompress(data, size + 1)
        if machine.eof or len(result) > size:
            return result
        parts = [result]
        made = len(result)
        while made <= size and not machine.eof:
            part = machine.decompress(b'', size + 1 - made)
            if not part:
                break
            parts.append(part)
            made += len(part)
    except (zstd.ZstdError, RuntimeError, OSError, ValueError, EOFError, MemoryError) as error:
        raise DamagedError(
            f'Expected compressed data, got what cannot be unpacked: {error}'
        ) from None
    if not machine.eof:
        raise DamagedError(
            f'Expected a whole compressed stream of {size} bytes, got its first {made}.'
        )
    return b''.join(parts)


def decompress_prefix(data: bytes | memoryview, method: str, size: int) -> bytes:
    """What a stream that was cut still gives: its beginning, at most `size` bytes, or none."""
    if size > MAX_BLOCK:
        return b''
    if method in ('', 'none'):
        return bytes(data[:size])
    parts: list[bytes] = []
    made = 0
    try:
        machine = _decompressor(method)
        part = machine.decompress(bytes(data), min(_STEP, size))
        while part and made < size:
            parts.append(part)
            made += len(part)
            if machine.eof or made >= size:
                break
            part = machine.decompress(b'', min(_STEP, size - made))
    except (DamagedError, zstd.ZstdError, RuntimeError, OSError, ValueError, EOFError):
        pass
    return b''.join(parts)

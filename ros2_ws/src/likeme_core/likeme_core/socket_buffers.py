"""Whether the kernel grants the UDP buffers that camera frames between hosts need."""

from __future__ import annotations

from pathlib import Path

#: Bytes, as in likeme_bringup/config/fastdds.xml: 640x480 colour and depth are 1.5 MB a frame.
WANTED = 4 * 2**20
LIMITS = Path('/proc/sys/net/core')


def too_small(limits: Path = LIMITS) -> str | None:
    """The limits below WANTED and the cure, in one sentence; None: large enough, or unknown.

    limits: folder of rmem_max and wmem_max, bytes; a container may hide them.
    """
    small = [
        f'net.core.{name} {value}'
        for name in ('rmem_max', 'wmem_max')
        if (value := _limit(limits / name)) is not None and value < WANTED
    ]
    if not small:
        return None
    return (
        f'Expected socket buffers of {WANTED} bytes for frames between hosts, got '
        f'{" and ".join(small)}: frames will be lost until you run '
        f'"sudo sysctl -w net.core.rmem_max={WANTED} net.core.wmem_max={WANTED}".'
    )


def _limit(path: Path) -> int | None:
    try:
        return int(path.read_text())
    except (OSError, ValueError):
        return None

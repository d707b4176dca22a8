"""Files of one JSON document a line, that grow by whole lines however roughly a writer ends."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any


def append(path: Path, document: Mapping[str, Any]) -> None:
    """Add one more; it outlasts a power-off when this returns.

    Raises:
        OSError: it cannot be written.
    """
    # What a kill tore has no end of line: the torn line must not swallow this one.
    start = '\n' if _is_torn(path) else ''
    with path.open('a', encoding='utf-8') as file:
        file.write(start + json.dumps(document) + '\n')
        file.flush()
        os.fsync(file.fileno())


def documents(path: Path) -> Iterator[dict[str, Any]]:
    """Those that are whole, in their order; none without the file."""
    if not path.exists():
        return
    for line in path.read_text(encoding='utf-8', errors='replace').splitlines():
        try:
            found = json.loads(line)
        except ValueError:
            continue
        if isinstance(found, dict):
            yield found


def _is_torn(path: Path) -> bool:
    if not path.exists() or path.stat().st_size == 0:
        return False
    with path.open('rb') as file:
        file.seek(-1, os.SEEK_END)
        return file.read() != b'\n'

"""Append-only files of one JSON document a line; a line torn by a crash is skipped."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any


def append(path: Path, document: Mapping[str, Any]) -> None:
    """Append one document and sync the file to disk.

    Raises:
        OSError: it cannot be written.
    """
    # A torn line has no end: begin a new one, or this document would be lost with it.
    start = '\n' if _is_torn(path) else ''
    with path.open('a', encoding='utf-8') as file:
        file.write(start + json.dumps(document) + '\n')
        file.flush()
        os.fsync(file.fileno())


def documents(path: Path) -> Iterator[dict[str, Any]]:
    """The complete documents, in order; none if the file does not exist."""
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

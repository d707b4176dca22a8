"""Where experience is kept, and what kind of file a path is."""

from __future__ import annotations

import os
from pathlib import Path

from likeme_inference.experience.store import ExperienceStore


def open_store(place: str | None) -> ExperienceStore:
    """The store at `place` (SQLite file or database URL) or the default one; may be created."""
    if place is None:
        Path(default_place()).parent.mkdir(exist_ok=True)
    return ExperienceStore(place or default_place())


def default_place() -> str:
    """out/experience.sqlite of the project."""
    return str(Path(os.environ.get('LIKEME_ROOT', '.')) / 'out' / 'experience.sqlite')


def is_sqlite(path: Path) -> bool:
    """Whether a file is an SQLite database."""
    try:
        with path.open('rb') as file:
            return file.read(16) == b'SQLite format 3\0'
    except OSError:
        return False

"""Where experience is kept, and what kind of file a path is."""

from __future__ import annotations

import os
from pathlib import Path

from likeme_core.world import World
from likeme_core.world.file import DEFAULT_WORLD
from likeme_inference.experience.store import ExperienceStore


def open_store(world: World, place: str | None) -> ExperienceStore:
    """The store at `place` (SQLite file or database URL) or the default one; may be created."""
    if place is None:
        Path(default_place(world)).parent.mkdir(exist_ok=True)
    return ExperienceStore(place or default_place(world), world)


def default_place(world: World) -> str:
    """out/experience.sqlite of the project; of another than the default world, with its name."""
    of = '' if world.source == DEFAULT_WORLD else f'-{world.name}'
    return str(Path(os.environ.get('LIKEME_ROOT', '.')) / 'out' / f'experience{of}.sqlite')


def is_sqlite(path: Path) -> bool:
    """Whether a file is an SQLite database."""
    try:
        with path.open('rb') as file:
            return file.read(16) == b'SQLite format 3\0'
    except OSError:
        return False

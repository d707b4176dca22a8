"""A store on a read-only file system, in a read-only folder, or whose file is read-only."""

from __future__ import annotations

import json
import shutil
import sqlite3
from contextlib import closing
from itertools import product
from pathlib import Path
from typing import NamedTuple

import pytest
from example_trials import trial

from likeme_core.paper_world import WORLD
from likeme_inference.experience.store import ExperienceStore
from unprivileged import unprivileged

HERE = Path(__file__).parent
# For each store: reads trials while they are counted, tries to write, and asks whether it can.
PROGRAM = """
import json, sys
sys.path.insert(0, sys.argv[1])
from example_trials import trial
from likeme_inference.experience.store_error import StoreError
from likeme_core.paper_world import WORLD
from likeme_inference.experience.store import ExperienceStore

def said(place):
    try:
        store = ExperienceStore(place, WORLD)
        trials = store.trials()
        next(trials)
        yield f'{sum(tally.trials for tally in store.tallies())} {1 + len(list(trials))}'
    except StoreError as error:
        yield str(error)
        return
    for write in (lambda: store.record([trial(99)]), store.check_writable):
        try:
            write()
        except StoreError as error:
            yield str(error)

print(json.dumps([list(said(place)) for place in sys.argv[2:]]))
"""


def tried(*places: str | Path) -> list[list[str]]:
    """What the program says of each store."""
    said: list[list[str]] = json.loads(unprivileged(PROGRAM, str(HERE), *map(str, places)))
    return said


def closed_store(folder: Path) -> Path:
    """A store of two trials with everything in its one file."""
    path = folder / 'experience.sqlite'
    with closing(ExperienceStore(str(path), WORLD)) as store:
        store.record([trial(0), trial(1)])
    return path


def open_store(folder: Path, copied: tuple[str, ...]) -> Path:
    """A store whose second trial is in the write-ahead log alone, copied while it was open."""
    source = folder / 'source'
    source.mkdir()
    path = closed_store(source)
    with closing(sqlite3.connect(path)) as other, other:
        other.execute('DELETE FROM likeme_trial WHERE repetition = 1')
    with closing(ExperienceStore(str(path), WORLD)) as store:
        store.record([trial(1)])
        for suffix in ('', *copied):
            shutil.copy(f'{path}{suffix}', folder / f'{path.name}{suffix}')
    shutil.rmtree(source)
    return folder / path.name


def rollback_store(folder: Path) -> Path:
    """A store whose file is kept without a write-ahead log."""
    path = closed_store(folder)
    with closing(sqlite3.connect(path)) as other:
        other.execute('PRAGMA journal_mode=DELETE')
    return path


def store_with(folder: Path, *suffixes: str) -> Path:
    """A closed store beside which empty files were left."""
    path = closed_store(folder)
    for suffix in suffixes:
        Path(f'{path}{suffix}').touch()
    return path


KINDS = {
    'closed': closed_store,
    'rollback journal': rollback_store,
    'empty -wal': lambda folder: store_with(folder, '-wal'),
    'empty -shm': lambda folder: store_with(folder, '-shm'),
    'empty -wal and -shm': lambda folder: store_with(folder, '-wal', '-shm'),
    '-wal': lambda folder: open_store(folder, ('-wal',)),
    '-wal and -shm': lambda folder: open_store(folder, ('-wal', '-shm')),
}


MODES = ('file', 'file system')


class ReadOnly(NamedTuple):
    """A read-only store: what was said of it, its file and its folder before and after."""

    path: Path
    said: list[str]
    before: tuple[bytes, list[Path]]
    after: tuple[bytes, list[Path]]


def contents(path: Path) -> tuple[bytes, list[Path]]:
    return path.read_bytes(), sorted(path.parent.iterdir())


@pytest.fixture(scope='module')
def stores(tmp_path_factory: pytest.TempPathFactory) -> dict[tuple[str, str], ReadOnly]:
    """Stores of every kind, tried by one process."""
    paths = {}
    for kind, mode in product(KINDS, MODES):
        folder = tmp_path_factory.mktemp('store') / 'a #1 100%?'
        folder.mkdir()
        path = paths[kind, mode] = KINDS[kind](folder)
        for part in [path] if mode == 'file' else list(folder.iterdir()):
            part.chmod(0o444)
        folder.chmod(0o555 if mode == 'file system' else 0o755)
    before = [contents(path) for path in paths.values()]
    said = tried(*paths.values())
    after = [contents(path) for path in paths.values()]
    for path in paths.values():
        path.parent.chmod(0o755)
    return dict(zip(paths, map(ReadOnly, paths.values(), said, before, after), strict=True))


@pytest.mark.parametrize('mode', MODES)
@pytest.mark.parametrize('kind', KINDS)
def test_a_read_only_store_is_read_and_not_written_to(
    stores: dict[tuple[str, str], ReadOnly], kind: str, mode: str
) -> None:
    store = stores[kind, mode]
    why = f'{store.path} cannot be written to: the file or its folder is read-only.'
    assert store.said == ['2 2', why, why]
    assert store.after == store.before


def test_what_cannot_be_opened_is_refused_and_a_url_names_a_read_only_store(
    tmp_path: Path,
) -> None:
    folder = tmp_path / 'folder'
    folder.mkdir(mode=0o555)
    unmade = folder / 'experience.sqlite'
    (tmp_path / 'unreadable').mkdir()
    unreadable = closed_store(tmp_path / 'unreadable')
    unreadable.chmod(0)
    (tmp_path / 'named').mkdir()
    named = closed_store(tmp_path / 'named')
    named.chmod(0o444)
    named.parent.chmod(0o555)
    urls = (f'sqlite:///{named}', f'sqlite:///file:{named}?immutable=1&uri=true')
    first, second, *others = tried(unmade, unreadable, *urls)
    named.parent.chmod(0o755)
    assert first == [f'{unmade} cannot be made: its folder is read-only.']
    assert second == [f'{unreadable} cannot be read: permission denied.']
    assert [said[0] for said in others] == ['2 2', '2 2']


def test_trials_are_imported_from_a_read_only_store(tmp_path: Path) -> None:
    archive = tmp_path / 'archive'
    archive.mkdir()
    path = closed_store(archive)
    archive.chmod(0o555)
    target = tmp_path / 'mine.sqlite'
    program = (
        'import sys; from likeme_experiments.commands.learn import app; '
        'app(["import", sys.argv[1], "--store", sys.argv[2]], standalone_mode=False)'
    )
    said = unprivileged(program, str(path), str(target))
    archive.chmod(0o755)
    assert said == f'{path}: 2 trials new, 0 known.'

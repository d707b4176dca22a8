"""A store on a read-only file system, in a read-only folder, or whose file is read-only."""

from __future__ import annotations

import os
import shutil
import sqlite3
import subprocess
import sys
from contextlib import closing
from pathlib import Path

import pytest
from example_trials import trial

from likeme_core.paper_world import WORLD
from likeme_inference.experience.store import ExperienceStore

HERE = Path(__file__).parent
# Root may write where the file's mode forbids it, except without this capability.
UNPRIVILEGED = (
    ['setpriv', '--bounding-set=-dac_override,-dac_read_search'] if os.geteuid() == 0 else []
)
# Reads trials while they are counted, tries to write, and asks whether that can be.
PROGRAM = """
import sys
sys.path.insert(0, sys.argv[2])
from example_trials import trial
from likeme_inference.experience.database import StoreError
from likeme_core.paper_world import WORLD
from likeme_inference.experience.store import ExperienceStore
try:
    store = ExperienceStore(sys.argv[1], WORLD)
    trials = store.trials()
    next(trials)
    print(sum(tally.trials for tally in store.tallies()), 1 + len(list(trials)))
except StoreError as error:
    sys.exit(print(error))
for write in (lambda: store.record([trial(99)]), store.check_writable):
    try:
        write()
    except StoreError as error:
        print(error)
"""


def unprivileged(program: str, *arguments: str) -> str:
    """What a program prints that file modes hold for."""
    command = [*UNPRIVILEGED, sys.executable, '-c', program, *arguments]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


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


@pytest.fixture(params=KINDS)
def path(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    folder = tmp_path / 'a #1 100%?'
    folder.mkdir()
    return KINDS[request.param](folder)


@pytest.mark.parametrize('mode', ['file', 'file system'])
def test_a_read_only_store_is_read_and_not_written_to(path: Path, mode: str) -> None:
    parts = [path] if mode == 'file' else list(path.parent.iterdir())
    for part in parts:
        part.chmod(0o444)
    path.parent.chmod(0o555 if mode == 'file system' else 0o755)
    before = path.read_bytes(), sorted(path.parent.iterdir())
    said = unprivileged(PROGRAM, str(path), str(HERE))
    after = path.read_bytes(), sorted(path.parent.iterdir())
    path.parent.chmod(0o755)
    why = f'{path} cannot be written to: the file or its folder is read-only.'
    assert said.splitlines() == ['2 2', why, why]
    assert after == before


def test_a_store_is_not_made_in_a_read_only_folder(tmp_path: Path) -> None:
    folder = tmp_path / 'folder'
    folder.mkdir(mode=0o555)
    path = folder / 'experience.sqlite'
    said = unprivileged(PROGRAM, str(path), str(HERE))
    assert said == f'{path} cannot be made: its folder is read-only.'


def test_a_store_without_read_permission_is_refused(tmp_path: Path) -> None:
    path = closed_store(tmp_path)
    path.chmod(0)
    said = unprivileged(PROGRAM, str(path), str(HERE))
    assert said == f'{path} cannot be read: permission denied.'


@pytest.mark.parametrize('url', ['sqlite:///{}', 'sqlite:///file:{}?immutable=1&uri=true'])
def test_a_url_names_a_read_only_store_too(tmp_path: Path, url: str) -> None:
    path = closed_store(tmp_path)
    path.chmod(0o444)
    tmp_path.chmod(0o555)
    said = unprivileged(PROGRAM, url.format(path), str(HERE))
    tmp_path.chmod(0o755)
    assert said.startswith('2 2\n')


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

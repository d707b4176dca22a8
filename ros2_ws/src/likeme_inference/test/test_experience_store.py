"""The experience store: nothing lost, nothing twice, nothing foreign touched."""

from __future__ import annotations

import sqlite3
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest
from example_trials import PEAR, trial
from hypothesis import given, settings
from hypothesis import strategies as st
from sqlalchemy.dialects import mysql, postgresql
from sqlalchemy.schema import CreateTable

from likeme_core.paper_world import LEFT, OFFTABLE, PLACE_LEFT, PUSH_RIGHT, RIGHT, WORLD
from likeme_inference.experience.model_from_trials import robot_model
from likeme_inference.experience.schema import metadata, trials
from likeme_inference.experience.store import BATCH, ExperienceStore
from likeme_inference.experience.store_error import StoreError
from likeme_inference.experience.trial import Pair
from likeme_inference.tabletop.model_file import format_model
from likeme_inference.tabletop.model_parser import parse

WRITER = """
import sys
sys.path.insert(0, sys.argv[1])
from example_trials import trial
from likeme_core.paper_world import WORLD
from likeme_inference.experience.store import ExperienceStore
store = ExperienceStore(sys.argv[2], WORLD)
for repetition in range(int(sys.argv[3]), int(sys.argv[4])):
    store.record([trial(repetition)])
    print(repetition, flush=True)
"""


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / 'experience.sqlite'


@pytest.fixture
def store(path: Path) -> Iterator[ExperienceStore]:
    with closing(ExperienceStore(str(path), WORLD)) as opened:
        yield opened


def writer(path: Path, first: int, last: int) -> subprocess.Popen[str]:
    command = [sys.executable, '-c', WRITER, str(Path(__file__).parent), str(path)]
    return subprocess.Popen(
        [*command, str(first), str(last)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def test_store_round_trip(store: ExperienceStore) -> None:
    assert store.record([trial()]).new == 1
    assert list(store.trials()) == [trial()]


def test_several_batches_recorded_twice(store: ExperienceStore, path: Path) -> None:
    many = [trial(n) for n in range(BATCH + 5)]
    assert store.record(many)[:2] == (BATCH + 5, 0)
    with closing(ExperienceStore(str(path), WORLD, create=False)) as again:
        assert again.record(many)[:2] == (0, BATCH + 5)
        assert again.counts(('pear',))['pear'][PEAR.x_i, PEAR.action].tolist() == [0, BATCH + 5, 0]


def test_contradicting_records_are_reported_and_the_first_is_kept(store: ExperienceStore) -> None:
    store.record([trial(0)])
    said = store.record([trial(0, x_f=LEFT), trial(1), trial(1, x_f=OFFTABLE)])
    identities = trial(0).key.identity, trial(1).key.identity
    assert (said.new, said.known, set(said.contradicting)) == (1, 2, set(identities))
    assert {t.x_f for t in store.trials()} == {RIGHT}


def test_model_from_trials_by_source(store: ExperienceStore) -> None:
    left = Pair('lemon', RIGHT, PLACE_LEFT)
    store.record([trial(0), trial(1, x_f=LEFT), trial(0, robot='other'), trial(0, left)])
    model = robot_model(store)
    assert model.model_of('pear').counts[LEFT, PUSH_RIGHT].tolist() == [1, 2, 0]
    assert set(model.sources) == {'robot/test-1', 'other/test-1'}
    assert model.version == '4'
    alone = robot_model(store, robots=['other'])
    assert (list(alone.objects), alone.version) == (['pear'], '1')
    assert parse(format_model(model)).rows == model.rows


def test_no_trial_makes_a_model_without_rows(store: ExperienceStore) -> None:
    assert parse(format_model(robot_model(store))).rows == ()


@settings(max_examples=25, deadline=None)
@given(st.lists(st.lists(st.integers(0, 12), max_size=12), min_size=1, max_size=4))
def test_merging_in_any_order_counts_each_once(parts: list[list[int]]) -> None:
    stores = [ExperienceStore('sqlite://', WORLD) for _ in range(2)]
    for store, order in zip(stores, (parts, parts[::-1]), strict=True):
        for part in order:
            store.record(trial(n) for n in part)
    one, other = (list(store.trials()) for store in stores)
    assert one == other
    assert {t.key.repetition for t in one} == {n for part in parts for n in part}
    for store in stores:
        store.close()


def test_concurrent_writers_lose_no_trial(path: Path) -> None:
    # Overlapping ranges: every trial is written by two of them.
    writers = [writer(path, first, first + 40) for first in range(0, 80, 20)]
    said = [process.communicate(timeout=60) for process in writers]
    assert [process.returncode for process in writers] == [0] * 4, said
    with closing(ExperienceStore(str(path), WORLD, create=False)) as store:
        assert sorted(t.key.repetition for t in store.trials()) == list(range(100))


def test_a_killed_writer_loses_no_recorded_trial(path: Path) -> None:
    process = writer(path, 0, 100_000)
    assert process.stdout is not None
    said = [int(process.stdout.readline()) for _ in range(20)]
    process.kill()
    said += [int(line) for line in process.communicate()[0].splitlines() if line]
    with closing(ExperienceStore(str(path), WORLD, create=False)) as store:
        kept = sorted(t.key.repetition for t in store.trials())
    assert kept[: len(said)] == said
    assert len(kept) <= len(said) + 1


def broken(path: Path, kind: str) -> None:
    if kind == 'text':
        path.write_text('Dear diary, the pear rolled off again.\n' * 50)
        return
    if kind == 'foreign':
        with closing(sqlite3.connect(path)) as other:
            other.execute('CREATE TABLE recipes (name TEXT)')
        return
    with closing(ExperienceStore(str(path), WORLD)) as store:
        store.record(trial(n) for n in range(500))
    if kind == 'torn':
        whole = path.read_bytes()
        path.write_bytes(whole[: len(whole) // 2])
        return
    with closing(sqlite3.connect(path)) as other, other:
        if kind == 'newer':
            other.execute('UPDATE likeme_experience SET schema_version = 7')
        else:
            other.execute('DELETE FROM likeme_experience')


@pytest.mark.parametrize(
    ('kind', 'why'),
    [
        ('text', 'expected an SQLite database'),
        ('foreign', 'got one of other tables (recipes)'),
        ('torn', 'is damaged'),
        ('newer', 'expected schema version 1, got 7'),
        ('unversioned', 'expected one schema version, got 0'),
    ],
)
def test_other_databases_are_rejected_unchanged(path: Path, kind: str, why: str) -> None:
    broken(path, kind)
    before = path.read_bytes()
    with pytest.raises(StoreError) as refused:
        ExperienceStore(str(path), WORLD)
    assert why in str(refused.value)
    assert '\n' not in str(refused.value)
    assert path.read_bytes() == before


def test_a_locked_store_is_rejected_unchanged(path: Path) -> None:
    with closing(ExperienceStore(str(path), WORLD, lock_timeout=0.2)) as store:
        store.record([trial(0)])
        with closing(sqlite3.connect(path, isolation_level=None)) as other:
            other.execute('BEGIN IMMEDIATE')
            with pytest.raises(StoreError, match='is locked'):
                store.record([trial(1)])
            # Readers need not wait for the writer.
            assert len(list(store.trials())) == 1
        assert store.record([trial(1)]).new == 1


@pytest.mark.parametrize(
    ('place', 'why'),
    [
        ('no/such/folder/x.sqlite', 'no folder'),
        ('.', 'a folder'),
        ('telepathy://host/name', 'no driver'),
        ('://', 'Expected a path or a URL'),
    ],
)
def test_invalid_places_are_rejected(place: str, why: str) -> None:
    with pytest.raises(StoreError, match=why):
        ExperienceStore(place, WORLD)


def test_reading_creates_no_file(path: Path) -> None:
    with pytest.raises(StoreError, match='nothing is recorded there yet'):
        ExperienceStore(str(path), WORLD, create=False)
    assert not path.exists()


def test_unknown_numbers_in_a_row_are_rejected(path: Path, store: ExperienceStore) -> None:
    store.record([trial(0)])
    with closing(sqlite3.connect(path)) as other, other:
        other.execute('UPDATE likeme_trial SET motion = 77')
    with pytest.raises(StoreError, match='77 is not a valid Motion'):
        list(store.trials())


@pytest.mark.parametrize('dialect', [postgresql.dialect(), mysql.dialect()], ids=['pg', 'mysql'])
def test_schema_compiles_for_other_databases(dialect: postgresql.dialect) -> None:
    for table in metadata.sorted_tables:
        assert 'PRIMARY KEY' in str(CreateTable(table).compile(dialect=dialect))
    assert trials.c.seed.type.compile(dialect=dialect) == 'BIGINT'


def test_a_number_that_the_world_does_not_have_is_refused(
    store: ExperienceStore, path: Path
) -> None:
    store.record([trial(0)])
    with closing(sqlite3.connect(path)) as other, other:
        other.execute('UPDATE likeme_trial SET x_f = 9')
    with pytest.raises(StoreError, match='a trial cannot be read: Expected a state of chung2015'):
        store.tallies()

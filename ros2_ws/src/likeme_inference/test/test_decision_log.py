"""The decision log: every change is found, nothing is overwritten, writers queue."""

from __future__ import annotations

import json
import random
import sqlite3
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from likeme_core.paper_world import WORLD
from likeme_inference.experience.decision_log import DecisionLog
from likeme_inference.experience.store import ExperienceStore
from likeme_inference.experience.store_error import StoreError
from unprivileged import unprivileged

TEN = [('decision', json.dumps({'id': n, 'p': 0.1 * n}, sort_keys=True)) for n in range(10)]
COLUMNS = ('number', 'time', 'run', 'kind', 'text', 'previous', 'hash')
WRITER = """
import sys
from likeme_inference.experience.decision_log import DecisionLog
log = DecisionLog(sys.argv[1], lock_timeout=30)
for n in range(8):
    log.append(sys.argv[2], [('a', str(n)), ('b', str(n))])
"""


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / 'log.sqlite'


@pytest.fixture
def log(path: Path) -> Iterator[DecisionLog]:
    with closing(DecisionLog(str(path))) as opened:
        yield opened


def tamper(path: Path, *statements: str) -> None:
    """Change the database as somebody would who does not use this software."""
    with closing(sqlite3.connect(path)) as raw, raw:
        raw.execute('DROP TRIGGER likeme_log_no_update')
        raw.execute('DROP TRIGGER likeme_log_no_delete')
        for statement in statements:
            raw.execute(statement)


def test_entries_come_back_as_they_were_written(log: DecisionLog) -> None:
    numbers = {'p': 0.1 + 0.2, 'tiny': 5e-324, 'third': 1 / 3}
    assert log.append('run 1', [*TEN, ('belief', json.dumps(numbers))]) == 11
    entries = list(log.entries())
    assert [e.number for e in entries] == list(range(1, 12))
    assert [(e.kind, e.text) for e in entries[:10]] == TEN
    assert entries[10].data == numbers
    assert all(e.run == 'run 1' and e.intact for e in entries)
    assert [e.number for e in log.entries(['decision'], 3)] == [8, 9, 10]
    assert log.verify() == (11, entries[-1].hash, '')


@pytest.mark.parametrize('column', COLUMNS)
def test_any_changed_byte_is_found(log: DecisionLog, path: Path, column: str) -> None:
    log.append('run', TEN)
    with closing(sqlite3.connect(path)) as raw:
        (kept,) = raw.execute(f'SELECT {column} FROM likeme_log WHERE number = 4').fetchone()
    chance = random.Random(column)
    for _ in range(5):
        if isinstance(kept, int):
            other: Any = kept + chance.choice([100, -100, 10**6])
        else:
            at = chance.randrange(len(kept))
            other = kept[:at] + chr(ord(kept[at]) ^ 1) + kept[at + 1 :]
        with closing(sqlite3.connect(path)) as raw, raw:
            raw.execute('DROP TRIGGER IF EXISTS likeme_log_no_update')
            raw.execute(f'UPDATE likeme_log SET {column} = ? WHERE number = 4', [other])
        check = log.verify()
        first = 1 if column == 'number' and other < 0 else 4
        assert f'Entry {first} ' in check.problem
        assert check.entries == first - 1
        with closing(sqlite3.connect(path)) as raw, raw:
            where = other if column == 'number' else 4
            raw.execute(f'UPDATE likeme_log SET {column} = ? WHERE number = ?', [kept, where])
        assert not log.verify().problem


@pytest.mark.parametrize(
    ('statement', 'said'),
    [
        ('DELETE FROM likeme_log WHERE number = 6', 'Entry 6 is missing: the next one is 7.'),
        ('DELETE FROM likeme_log WHERE number = 1', 'Entry 1 is missing'),
        ("UPDATE likeme_log SET text = X'00FF' WHERE number = 3", 'Entry 3 is not what'),
        (
            "INSERT INTO likeme_log SELECT 11, time, run, kind, text, previous, hash "
            'FROM likeme_log WHERE number = 10',
            'Entry 11 is not what was written',
        ),
        (
            'UPDATE likeme_log SET number = CASE number WHEN 4 THEN 105 ELSE 104 END '
            'WHERE number IN (4, 5)',
            'Entry 4 is missing',
        ),
        ("UPDATE likeme_log SET text = CAST(X'41FF' AS TEXT) WHERE number = 5", 'Entry 5 '),
    ],
)  # fmt: skip
def test_removed_inserted_and_moved_entries(
    log: DecisionLog, path: Path, statement: str, said: str
) -> None:
    log.append('run', TEN)
    tamper(path, statement)
    assert said in log.verify().problem


def test_swapped_entries(log: DecisionLog, path: Path) -> None:
    log.append('run', TEN)
    moves = [(4, 100), (5, 4), (100, 5)]
    tamper(path, *(f'UPDATE likeme_log SET number={b} WHERE number={a}' for a, b in moves))
    assert 'Entry 4 is not what was written' in log.verify().problem


def test_an_entry_with_a_hash_of_its_own_breaks_the_chain(log: DecisionLog, path: Path) -> None:
    log.append('run', TEN)
    entry = list(log.entries())[3]._replace(text='{"id":77}')
    from likeme_inference.experience.decision_log import hash_of

    forged = hash_of(*entry[:-1])
    tamper(
        path, f"UPDATE likeme_log SET text='{entry.text}', hash='{forged}' WHERE number=4"
    )  # fmt: skip
    assert 'Entry 5 does not continue the one before it' in log.verify().problem


def test_a_tail_that_was_cut_off_is_found_by_a_head_that_was_noted(
    log: DecisionLog, path: Path
) -> None:
    log.append('run', TEN)
    head = log.verify().head
    tamper(path, 'DELETE FROM likeme_log WHERE number > 8')
    assert log.verify().problem == ''
    assert 'none of its 8 entries is the head' in log.verify(head).problem
    assert not log.verify(list(log.entries())[2].hash[:12]).problem


@pytest.mark.parametrize('statement', ['UPDATE likeme_log SET kind = 1', 'DELETE FROM likeme_log'])
def test_sqlite_refuses_changes(log: DecisionLog, path: Path, statement: str) -> None:
    log.append('run', TEN)
    with (
        closing(sqlite3.connect(path)) as raw,
        pytest.raises(sqlite3.IntegrityError, match='never changed'),
    ):
        raw.execute(statement)
    assert log.verify().entries == 10


def test_several_processes_append_to_one_chain(log: DecisionLog, path: Path) -> None:
    log.append('first', TEN[:1])
    writers = [subprocess.Popen([sys.executable, '-c', WRITER, str(path), name]) for name in 'xyz']
    assert [writer.wait(60) for writer in writers] == [0, 0, 0]
    entries = list(log.entries())
    assert len(entries) == 49
    assert not log.verify().problem
    # Both entries of a transaction are together.
    assert all(a.run == b.run for a, b in zip(entries[1::2], entries[2::2], strict=True))


def test_an_experience_store_gets_its_log_with_the_first_entry(path: Path) -> None:
    with closing(ExperienceStore(str(path), WORLD)):
        pass
    with pytest.raises(StoreError, match='there is no decision log yet'):
        DecisionLog(str(path), create=False)
    with closing(DecisionLog(str(path))) as log:
        assert list(log.entries()) == []
        log.append('run', TEN)
    with closing(DecisionLog(str(path), create=False)) as log:
        assert log.verify().entries == 10
    with closing(ExperienceStore(str(path), WORLD, create=False)) as store:
        assert list(store.trials()) == []


READER = """
import sys
from likeme_inference.experience.decision_log import DecisionLog
from likeme_inference.experience.store_error import StoreError

log = DecisionLog(sys.argv[1], create=False)
print(log.verify().entries)
try:
    log.append('run', [('remark', '{}')])
except StoreError as error:
    print(error)
"""


def locked(path: Path) -> Callable[[], None]:
    other = sqlite3.connect(path, isolation_level=None)
    other.execute('BEGIN IMMEDIATE')
    return other.close


def read_only(path: Path) -> Callable[[], None]:
    with closing(sqlite3.connect(path)) as raw:
        raw.execute('PRAGMA journal_mode=DELETE')
    path.chmod(0o400)
    path.parent.chmod(0o500)
    return lambda: path.parent.chmod(0o700)


def test_a_locked_log_is_said_in_one_sentence(log: DecisionLog, path: Path) -> None:
    log.append('run', TEN)
    release = locked(path)
    with closing(DecisionLog(str(path), lock_timeout=0.1)) as other:
        with pytest.raises(StoreError, match='is locked: somebody else has been writing') as said:
            other.append('run', TEN)
        assert '\n' not in str(said.value)
        assert len(list(other.entries())) == 10
        release()
        assert other.append('run', TEN) == 20


def test_a_read_only_log(log: DecisionLog, path: Path) -> None:
    log.append('run', TEN)
    log.close()
    undo = read_only(path)
    try:
        entries, refused = unprivileged(READER, str(path)).splitlines()
    finally:
        undo()
    assert entries == '10'
    assert refused == f'{path} cannot be written to: the file or its folder is read-only.'


REPAIRER = """
import sys
from pathlib import Path
from likeme_inference.experience.decision_log import DecisionLog
from likeme_inference.experience.store_error import StoreError

path = Path(sys.argv[1])
log = DecisionLog(str(path), create=False)
try:
    log.append('run', [('remark', '{}')])
except StoreError as error:
    print(error)
path.parent.chmod(0o700)
for part in path.parent.glob(path.name + '*'):
    part.chmod(0o600)
print(log.append('run', [('remark', '{}')]))
"""


@pytest.mark.parametrize('in_use', [False, True])
def test_a_log_that_was_read_only_is_written_to_once_it_can_be(
    log: DecisionLog, path: Path, in_use: bool
) -> None:
    log.append('run', TEN)
    if in_use:
        # With its write-ahead log beside it, as while a node has it open.
        for part in path.parent.glob(f'{path.name}*'):
            part.chmod(0o400)
    else:
        log.close()
        read_only(path)
    refused, number = unprivileged(REPAIRER, str(path)).splitlines()
    assert refused == f'{path} cannot be written to: the file or its folder is read-only.'
    assert number == '11'


def test_a_full_disk_is_said_in_one_sentence(log: DecisionLog, path: Path) -> None:
    log.append('run', TEN)
    with log._engine.connect() as connection:
        pages = connection.exec_driver_sql('PRAGMA page_count').scalar()
        connection.exec_driver_sql(f'PRAGMA max_page_count = {pages}')
    # The pool has the one connection.
    with pytest.raises(StoreError, match='full'):
        log.append('run', [('decision', '"' + 'x' * 100_000 + '"')])
    assert log.verify().entries == 10

from __future__ import annotations

from pathlib import Path

import pytest

from likeme_arm import motion_journal
from likeme_arm.motion_journal import LOST_MESSAGE, JournalError, MotionJournal, MotionRecord
from likeme_core.outcomes import Actor, MotionOutcome
from unprivileged import unprivileged


def request(name: str) -> MotionRecord:
    return MotionRecord(name, Actor.ROBOT, 'chung2015@0', 'pear', 'push_left')


def ended(name: str) -> MotionRecord:
    return request(name)._replace(
        outcome=MotionOutcome.COMPLETED, message='Done.', started=5, finished=9
    )


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / 'motions.sqlite'


def test_a_request_counts_once_also_after_a_restart(path: Path) -> None:
    journal = MotionJournal(path)
    assert journal.begin(request('a')) is None
    assert journal.begin(request('a')) == request('a')
    journal.end(ended('a'))
    journal.close()
    again = MotionJournal(path)
    assert again.lost == []
    assert again.begin(request('a')) == ended('a')
    assert again.find('a') == ended('a')
    assert again.find('b') is None


def test_a_motion_under_way_when_the_driver_ended_is_lost(path: Path) -> None:
    # Not closed, as after kill -9.
    MotionJournal(path).begin(request('a'))
    lost = request('a')._replace(outcome=MotionOutcome.LOST, message=LOST_MESSAGE)
    again = MotionJournal(path)
    assert again.lost == [lost]
    assert again.find('a') == lost
    assert MotionJournal(path).lost == []


def test_the_latest_requests_are_kept(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(motion_journal, 'KEPT', 3)
    journal = MotionJournal(path)
    for number in range(6):
        journal.begin(request(str(number)))
    assert [number for number in range(6) if journal.find(str(number))] == [3, 4, 5]


WRITER = """
import sys
from pathlib import Path
from likeme_arm.motion_journal import JournalError, MotionJournal, MotionRecord
from likeme_core.outcomes import Actor

files = [Path(name) for name in sys.argv[1:]]
journal = MotionJournal(files[0])
request = MotionRecord('b', Actor.ROBOT, 'chung2015@0', 'pear', 'push_left')
try:
    journal.begin(request)
except JournalError as error:
    print(error)
for file in files:
    file.chmod(0o600)
print(journal.begin(request))
"""


def test_a_journal_that_was_read_only_when_it_was_opened(path: Path) -> None:
    journal = MotionJournal(path)
    journal.begin(request('a'))
    journal.end(ended('a'))
    files = [path, *(Path(f'{path}{suffix}') for suffix in ('-wal', '-shm'))]
    for file in files:
        file.chmod(0o400)
    refused, begun = unprivileged(WRITER, *map(str, files)).splitlines()
    assert 'readonly' in refused
    assert begun == 'None'
    assert journal.find('b') == request('b')


@pytest.mark.parametrize('content', [b'this is no database, by its first bytes', None])
def test_what_is_no_journal_is_refused(path: Path, content: bytes | None) -> None:
    if content is None:
        path.mkdir()
    else:
        path.write_bytes(content)
    with pytest.raises(JournalError, match=r'motions\.sqlite'):
        MotionJournal(path)

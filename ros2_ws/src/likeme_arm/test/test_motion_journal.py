from __future__ import annotations

from pathlib import Path

import pytest

from likeme_arm import motion_journal
from likeme_arm.motion_journal import LOST_MESSAGE, JournalError, MotionJournal, MotionRecord
from likeme_core.outcomes import Actor, MotionOutcome


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


@pytest.mark.parametrize('content', [b'this is no database, by its first bytes', None])
def test_what_is_no_journal_is_refused(path: Path, content: bytes | None) -> None:
    if content is None:
        path.mkdir()
    else:
        path.write_bytes(content)
    with pytest.raises(JournalError, match=r'motions\.sqlite'):
        MotionJournal(path)

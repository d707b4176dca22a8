"""What a motion service says of requests that wait, are not known or cannot be looked up."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from concurrent.futures import Future
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from likeme_arm.motion import PrimitiveResult
from likeme_arm.motion_driver import MotionDriver, MotionRequest, StampedResult
from likeme_arm.motion_journal import MotionJournal
from likeme_arm.ros.motion_service import MotionService
from likeme_core.outcomes import Actor, MotionOutcome
from likeme_core.paper_world import WORLD
from likeme_msgs.msg import Motion
from likeme_msgs.srv import MotionStatus


class Driver(MotionDriver):
    """Every motion takes until `go` is set."""

    now, block = 5, None

    def __init__(self, journal: MotionJournal) -> None:
        super().__init__(WORLD, 1.0, lambda error: None, journal)
        self.go, self.idle = threading.Event(), threading.Event()
        self.begun: list[str] = []

    def hold(self) -> None:
        self.go.set()

    def _phase_of(self, actor: Actor) -> str:
        return 'move'

    def _perform(self, request: MotionRequest) -> tuple[PrimitiveResult, bool]:
        self.begun.append(request.id)
        assert self.go.wait(60)
        return PrimitiveResult(MotionOutcome.COMPLETED, 'Done.'), True

    def _idle(self) -> None:
        self.idle.wait(0.01)


class Table:
    """A driver with the services of arm and person."""

    def __init__(self, path: Path) -> None:
        self.journal = MotionJournal(path)
        self.driver = Driver(self.journal)
        node: Any = SimpleNamespace(
            create_service=lambda *args, **options: None,
            get_logger=lambda: SimpleNamespace(error=lambda sentence: None),
        )
        self.services = {
            actor: MotionService(node, self.driver, actor, self.journal)
            for actor in (Actor.ROBOT, Actor.HUMAN)
        }
        self.driver.start()

    def ask(self, actor: Actor, name: str) -> Future[StampedResult] | StampedResult:
        request = MotionRequest(actor, 'pear', 'push_left', id=name)
        return self.services[actor]._queue(request)

    def status(self, name: str, refuse_unknown: bool = False) -> Motion:
        request = MotionStatus.Request(id=name, refuse_unknown=refuse_unknown)
        return self.services[Actor.ROBOT]._status(request, MotionStatus.Response()).motion


@pytest.fixture
def table(tmp_path: Path) -> Iterator[Table]:
    table = Table(tmp_path / 'motions.sqlite')
    yield table
    table.driver.stop()
    table.journal.close()


def test_a_request_that_waits_for_the_persons_motion_is_under_way(table: Table) -> None:
    person = table.ask(Actor.HUMAN, 'shows')
    robot = table.ask(Actor.ROBOT, 'waits')
    assert isinstance(person, Future)
    assert isinstance(robot, Future)
    assert table.journal.find('waits') is None
    said = table.status('waits', refuse_unknown=True)
    assert (said.state, said.object, said.action) == (Motion.UNDER_WAY, 'pear', 'PUSH_LEFT')
    # That of the person is none of the arm's.
    assert table.status('shows').state == Motion.UNKNOWN
    table.driver.go.set()
    assert robot.result(60).outcome is MotionOutcome.COMPLETED
    assert table.driver.begun == ['shows', 'waits']
    assert table.status('waits').state == Motion.ENDED


def test_a_request_that_was_given_up_moves_nothing_when_it_comes(table: Table) -> None:
    table.driver.go.set()
    assert table.status('late', refuse_unknown=True).state == Motion.UNKNOWN
    late = table.ask(Actor.ROBOT, 'late')
    assert isinstance(late, StampedResult)
    assert (late.outcome, late.started) == (MotionOutcome.EXPIRED, 0)
    # Who only asks gives nothing up.
    assert table.status('asked').state == Motion.UNKNOWN
    asked = table.ask(Actor.ROBOT, 'asked')
    assert isinstance(asked, Future)
    assert asked.result(60).outcome is MotionOutcome.COMPLETED
    assert table.driver.begun == ['asked']


def test_a_journal_that_cannot_be_read_makes_no_request_unknown(table: Table) -> None:
    table.journal.close()
    said = table.status('any', refuse_unknown=True)
    assert said.state == Motion.UNDER_WAY
    assert said.message.startswith('It is not known whether it has ended: ')
    refused = table.ask(Actor.ROBOT, 'any')
    assert isinstance(refused, StampedResult)
    assert refused.outcome is MotionOutcome.FAILED
    assert refused.message.startswith('Nothing moved: ')

"""A call to the arm ends exactly once in every case."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import pytest

from likeme_core.outcomes import MotionOutcome
from likeme_inference.arm_call import (
    ABSENCE_TIMEOUT,
    SILENCE_TIMEOUT,
    ArmCall,
    ArmServices,
    NotSentError,
)
from likeme_inference.arm_motion import MotionState, StatusReport
from likeme_inference.tabletop.values import MotionReport

PUSHED = MotionReport(MotionOutcome.COMPLETED, 'Pushed.')
LOST = MotionReport(MotionOutcome.LOST, 'The driver was restarted.')


class FakeFuture:
    def __init__(self) -> None:
        self.callbacks: list[Callable[[FakeFuture], None]] = []
        self.value: Any = PUSHED

    def add_done_callback(self, callback: Callable[[FakeFuture], None]) -> None:
        self.callbacks.append(callback)

    def result(self) -> Any:
        return self.value

    def answer(self, value: Any = PUSHED) -> None:
        self.value = value
        for callback in self.callbacks:
            callback(self)


class FakeClient:
    """A fake client of one service."""

    def __init__(self, ready: bool) -> None:
        self.ready = ready
        self.sent: list[tuple[object, FakeFuture]] = []

    def service_is_ready(self) -> bool:
        return self.ready

    def call_async(self, request: object) -> FakeFuture:
        self.sent.append((request, FakeFuture()))
        return self.sent[-1][1]


class FakeArm:
    """Fake services and heartbeats of an arm, with the reports of an ArmCall that uses them.

    run: of the arm's heartbeats; empty: it has none. beat: when the last one came.
    """

    def __init__(self, ready: bool = True, run: str = '', tells: bool = False) -> None:
        self.execute, self.status = FakeClient(ready), FakeClient(tells)
        self.run, self.beat = run, 0.0
        self.reports: list[MotionReport] = []
        self.late: list[MotionReport] = []
        services = ArmServices(
            self.execute, self.status, lambda answer: answer, str, lambda answer: answer
        )
        self.call = ArmCall(services, self.reports.append, self.late.append, 5.0, 60.0, self)

    def silence(self, now: float) -> float:
        return now - self.beat if self.run else math.inf

    def poll(self, *times: float) -> None:
        for now in times:
            self.call.poll(now)

    def alive(self, *times: float) -> None:
        """Poll with a heartbeat each time."""
        for now in times:
            self.beat = now
            self.call.poll(now)

    def tell(self, state: MotionState, report: MotionReport = PUSHED) -> None:
        """Answer the last question about the motion."""
        self.status.sent[-1][1].answer(StatusReport(state, report))

    @property
    def sent(self) -> list[tuple[object, FakeFuture]]:
        return self.execute.sent

    @property
    def ready(self) -> bool:
        return self.execute.ready

    @ready.setter
    def ready(self, ready: bool) -> None:
        self.execute.ready = ready


def test_answered() -> None:
    arm = FakeArm()
    arm.call.start('id', lambda: 'push', now=0)
    arm.sent[0][1].answer()

    assert (arm.reports, arm.late, arm.call.busy) == ([PUSHED], [], False)


def test_the_service_may_come_within_arm_wait() -> None:
    arm = FakeArm(ready=False)
    arm.call.start('id', lambda: 'push', now=0)
    arm.call.poll(4.9)
    arm.ready = True
    arm.call.poll(4.95)
    arm.call.poll(5.1)

    assert [request for request, _ in arm.sent] == ['push']
    assert arm.reports == []


def test_absent() -> None:
    arm = FakeArm(ready=False)
    arm.call.start('id', lambda: 'push', now=0)
    arm.call.poll(5.0)
    arm.ready = True
    arm.call.poll(6.0)

    assert arm.sent == []
    assert [(r.outcome, r.message) for r in arm.reports] == [
        (None, 'the arm service was not there within 5 s.')
    ]


def test_vanished_and_back_is_not_called_again() -> None:
    arm = FakeArm()
    arm.call.start('id', lambda: 'push', now=0)
    arm.ready = False
    arm.call.poll(3.0)
    arm.call.poll(3.0 + ABSENCE_TIMEOUT)
    arm.ready = True
    for now in (5.0, 50.0, 70.0):
        arm.call.poll(now)

    assert len(arm.sent) == len(arm.reports) == 1
    assert arm.reports[0].message == 'the arm service vanished 3.0 s after the request.'


def test_a_service_that_is_not_ready_for_a_moment_has_not_vanished() -> None:
    """While a second server is discovered, the service counts as not ready."""
    arm = FakeArm()
    arm.call.start('id', lambda: 'push', now=0)
    for start in (3.0, 5.0):
        arm.ready = False
        arm.call.poll(start)
        arm.call.poll(start + 0.9 * ABSENCE_TIMEOUT)
        arm.ready = True
        arm.call.poll(start + 0.95 * ABSENCE_TIMEOUT)
    assert arm.reports == []
    arm.sent[0][1].answer()
    assert arm.reports == [PUSHED]


def test_timeout_then_late_answer() -> None:
    arm = FakeArm()
    arm.call.start('id', lambda: 'push', now=0)
    arm.call.poll(59.9)
    assert arm.reports == []
    arm.call.poll(60.0)
    arm.sent[0][1].answer()

    assert [report.outcome for report in arm.reports] == [None]
    assert arm.late == [PUSHED]


def test_a_late_answer_does_not_end_the_next_call() -> None:
    arm = FakeArm()
    arm.call.start('id', lambda: 'first', now=0)
    arm.call.poll(60.0)
    arm.call.start('id', lambda: 'second', now=61)
    arm.sent[0][1].answer()

    assert arm.call.busy
    assert arm.late == [PUSHED]
    arm.sent[1][1].answer()
    assert arm.reports[1:] == [PUSHED]


def test_a_second_call_is_rejected() -> None:
    arm = FakeArm()
    arm.call.start('id', lambda: 'first', now=3)

    with pytest.raises(ValueError, match='Expected no call under way, got one since 3 s'):
        arm.call.start('id', lambda: 'second', now=4)


def test_a_restarted_arm_is_asked_how_the_motion_ended() -> None:
    arm = FakeArm(run='one', tells=True)
    arm.call.start('id', lambda: 'push', now=0)
    arm.alive(0.1, 0.5)
    assert arm.status.sent == []
    arm.run = 'two'
    arm.alive(1.0)
    assert [request for request, _ in arm.status.sent] == ['id']
    arm.tell(MotionState.ENDED, LOST)

    assert (arm.reports, arm.call.busy, len(arm.sent)) == ([LOST], False, 1)
    # The first arm's answer comes after all.
    arm.sent[0][1].answer()
    assert (arm.reports, arm.late) == ([LOST], [PUSHED])


def test_a_silent_arm_is_asked_and_waited_for() -> None:
    arm = FakeArm(run='one', tells=True)
    arm.call.start('id', lambda: 'push', now=0)
    arm.alive(1.0)
    arm.poll(1.0 + 0.9 * SILENCE_TIMEOUT)
    assert arm.status.sent == []
    arm.poll(1.0 + SILENCE_TIMEOUT, 3.2, 3.4)
    assert len(arm.status.sent) == 1
    # It was only slow: its response counts.
    arm.alive(3.5, 9.0)
    assert arm.reports == []
    arm.sent[0][1].answer()
    assert arm.reports == [PUSHED]


def test_an_arm_that_does_not_come_back_has_lost_the_motion() -> None:
    arm = FakeArm(run='one', tells=True)
    arm.call.start('id', lambda: 'push', now=0)
    arm.alive(1.0)
    arm.poll(3.0, 5.0, 7.9)
    assert arm.reports == []
    arm.poll(8.0)

    assert [r.outcome for r in arm.reports] == [MotionOutcome.LOST]
    assert 'the arm has been silent for 7.0 s' in arm.reports[0].message
    assert len(arm.sent) == 1


def test_a_motion_that_is_under_way_is_waited_for() -> None:
    arm = FakeArm(run='one', tells=True)
    arm.call.resume('id', now=0)
    for now in (0.1, 3.0, 6.0, 9.0, 13.0):
        arm.alive(now)
        arm.tell(MotionState.UNDER_WAY)
    assert arm.reports == []
    arm.alive(14.0)
    arm.tell(MotionState.ENDED)

    assert (arm.reports, arm.sent) == ([PUSHED], [])


def test_a_request_that_never_arrived_moved_nothing() -> None:
    """Not at the first word: the request may be behind the question."""
    arm = FakeArm(run='one', tells=True)
    arm.call.resume('id', now=0)
    for now in (0.0, 0.5):
        arm.alive(now)
        arm.tell(MotionState.UNKNOWN)
    assert arm.reports == []
    arm.alive(1.0)
    arm.tell(MotionState.UNKNOWN)

    assert [(r.outcome, r.message) for r in arm.reports] == [
        (None, 'the arm never got the request, nothing moved.')
    ]


def test_after_a_restart_an_absent_arm_has_lost_the_motion() -> None:
    arm = FakeArm(ready=False)
    arm.call.resume('id', now=0)
    arm.poll(0.1, 4.9)
    assert arm.reports == []
    arm.poll(5.2)

    assert [r.outcome for r in arm.reports] == [MotionOutcome.LOST]
    assert arm.sent == []


def test_a_repeated_request_is_looked_up() -> None:
    arm = FakeArm(run='one', tells=True)
    arm.call.start('id', lambda: 'push', now=0)
    arm.sent[0][1].answer(MotionReport(MotionOutcome.REPEATED, 'Again.'))
    assert arm.reports == []
    arm.alive(0.1)
    arm.tell(MotionState.ENDED)
    assert arm.reports == [PUSHED]


def test_what_must_not_be_sent_is_reported_and_not_sent() -> None:
    def refuse() -> object:
        raise NotSentError('the log is full.')

    arm = FakeArm()
    arm.call.start('id', refuse, now=0)

    assert arm.sent == []
    assert [r.message for r in arm.reports] == ['the arm was not asked: the log is full.']


def test_an_arm_that_tells_nothing_of_itself_is_not_asked_while_it_is_there() -> None:
    arm = FakeArm(tells=True)
    arm.call.start('id', lambda: 'push', now=0)
    arm.poll(*range(1, 60))
    assert arm.status.sent == []


def test_a_request_lost_on_its_way_is_noticed_when_it_has_expired() -> None:
    arm = FakeArm(run='first', tells=True)
    arm.call.start('id', lambda: 'push', now=0)
    arm.alive(1, 2, 3, 4, 4.9)
    assert not arm.status.sent
    arm.alive(5)
    arm.tell(MotionState.UNKNOWN)
    arm.alive(6)
    assert arm.call.busy
    arm.tell(MotionState.UNKNOWN)

    assert [r.message for r in arm.reports] == ['the arm never got the request, nothing moved.']


def test_an_answer_lost_on_its_way_is_asked_for() -> None:
    arm = FakeArm(run='first', tells=True)
    arm.call.start('id', lambda: 'push', now=0)
    arm.alive(5)
    arm.tell(MotionState.ENDED)

    assert arm.reports == [PUSHED]


def test_a_motion_that_takes_its_time_is_asked_for_once() -> None:
    arm = FakeArm(run='first', tells=True)
    arm.call.start('id', lambda: 'push', now=0)
    arm.alive(5)
    arm.tell(MotionState.UNDER_WAY)
    arm.alive(*range(6, 50))
    assert len(arm.status.sent) == 1
    arm.sent[0][1].answer()

    assert arm.reports == [PUSHED]

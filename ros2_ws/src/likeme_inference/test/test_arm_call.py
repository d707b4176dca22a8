"""A call to the arm ends exactly once in every case."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from likeme_core.outcomes import MotionOutcome
from likeme_inference.arm_call import ABSENCE_TIMEOUT, ArmCall
from likeme_inference.tabletop.values import MotionReport

PUSHED = MotionReport(MotionOutcome.COMPLETED, 'Pushed.')


class FakeFuture:
    def __init__(self) -> None:
        self.callbacks: list[Callable[[FakeFuture], None]] = []

    def add_done_callback(self, callback: Callable[[FakeFuture], None]) -> None:
        self.callbacks.append(callback)

    def result(self) -> MotionReport:
        return PUSHED

    def answer(self) -> None:
        for callback in self.callbacks:
            callback(self)


class FakeArm:
    """A fake client, with the reports of an ArmCall that uses it."""

    def __init__(self, ready: bool = True) -> None:
        self.ready = ready
        self.sent: list[tuple[object, FakeFuture]] = []
        self.reports: list[MotionReport] = []
        self.late: list[MotionReport] = []
        self.call = ArmCall(
            self, lambda answer: answer, self.reports.append, self.late.append, 5.0, 60.0
        )

    def service_is_ready(self) -> bool:
        return self.ready

    def call_async(self, request: object) -> FakeFuture:
        self.sent.append((request, FakeFuture()))
        return self.sent[-1][1]


def test_answered() -> None:
    arm = FakeArm()
    arm.call.start(lambda: 'push', now=0)
    arm.sent[0][1].answer()

    assert (arm.reports, arm.late, arm.call.busy) == ([PUSHED], [], False)


def test_the_service_may_come_within_arm_wait() -> None:
    arm = FakeArm(ready=False)
    arm.call.start(lambda: 'push', now=0)
    arm.call.poll(4.9)
    arm.ready = True
    arm.call.poll(4.95)
    arm.call.poll(5.1)

    assert [request for request, _ in arm.sent] == ['push']
    assert arm.reports == []


def test_absent() -> None:
    arm = FakeArm(ready=False)
    arm.call.start(lambda: 'push', now=0)
    arm.call.poll(5.0)
    arm.ready = True
    arm.call.poll(6.0)

    assert arm.sent == []
    assert [(r.outcome, r.message) for r in arm.reports] == [
        (None, 'the arm service was not there within 5 s.')
    ]


def test_vanished_and_back_is_not_called_again() -> None:
    arm = FakeArm()
    arm.call.start(lambda: 'push', now=0)
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
    arm.call.start(lambda: 'push', now=0)
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
    arm.call.start(lambda: 'push', now=0)
    arm.call.poll(59.9)
    assert arm.reports == []
    arm.call.poll(60.0)
    arm.sent[0][1].answer()

    assert [report.outcome for report in arm.reports] == [None]
    assert arm.late == [PUSHED]


def test_a_late_answer_does_not_end_the_next_call() -> None:
    arm = FakeArm()
    arm.call.start(lambda: 'first', now=0)
    arm.call.poll(60.0)
    arm.call.start(lambda: 'second', now=61)
    arm.sent[0][1].answer()

    assert arm.call.busy
    assert arm.late == [PUSHED]
    arm.sent[1][1].answer()
    assert arm.reports[1:] == [PUSHED]


def test_a_second_call_is_rejected() -> None:
    arm = FakeArm()
    arm.call.start(lambda: 'first', now=3)

    with pytest.raises(ValueError, match='Expected no call under way, got one since 3 s'):
        arm.call.start(lambda: 'second', now=4)

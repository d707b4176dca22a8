"""A call to the arm service that ends exactly once and is never repeated.

While the arm cannot be relied on to answer (it was restarted, is silent, or its service vanished),
after a restart of this process, and when there is no answer by the time at which the request
expires (it may have been lost), the arm is asked by the request's id how the motion ended.

Plain Python against any client with rclpy's methods, so that tests can pass a fake. Times are s of
a monotonic clock, passed in.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

from likeme_core.outcomes import MotionOutcome
from likeme_inference.arm_motion import ArmHealth, MotionState, NeverHeard, StatusReport
from likeme_inference.tabletop.values import MotionReport

#: s for which the service must be absent during a call before it has vanished. While another
#: server is being discovered, the service is reported as not ready for a moment.
ABSENCE_TIMEOUT = 1.0
#: s without a heartbeat of the arm after which it is asked about the motion.
SILENCE_TIMEOUT = 2.0
#: s between two questions about the motion.
STATUS_PERIOD = 0.5
#: s for which the arm must not know a request before nothing moved: the request itself may still
#: be on its way while the question has arrived. LikeMe's drivers refuse it then (refuse_unknown).
UNKNOWN_FOR = 1.0


class NotSentError(Exception):
    """The request must not be sent; the message says why."""


class Future(Protocol):
    """The result of call_async."""

    def add_done_callback(self, callback: Callable[[Any], None]) -> Any:
        """Call `callback` with this future when the response has arrived."""

    def result(self) -> Any:
        """The response."""


class Client(Protocol):
    """The methods of a service client that are used."""

    def service_is_ready(self) -> bool:
        """Whether a server is matched."""

    def call_async(self, request: Any) -> Future:
        """Send a request."""


class ArmServices(NamedTuple):
    """The two services of an arm, and how their messages are made and read."""

    execute: Client
    status: Client
    read_answer: Callable[[Any], MotionReport]
    status_request: Callable[[str], Any]
    read_status: Callable[[Any], StatusReport]


@dataclass
class _Call:
    """A pending call: waits for the service until `sent`, then for the response.

    Attributes:
        restored: whether it was sent by an earlier run of this process.
        run: of the arm when it was sent.
        confirmed: whether the arm said that the motion is under way.
        absent, doubted, asked, told, unknown: times: since when the service is absent, since when
            the arm is asked how the motion ended, of the last question and of the last answer,
            and since when the arm says that it does not know the request.
    """

    motion_id: str
    request: Callable[[], Any]
    started: float
    sent: float | None = None
    restored: bool = False
    run: str = ''
    repeated: bool = False
    confirmed: bool = False
    absent: float | None = None
    doubted: float | None = None
    asked: float | None = None
    told: float | None = None
    unknown: float | None = None


class ArmCall:
    """Sends at most one request at a time and reports each exactly once, by `on_report`.

    Attributes:
        arm_wait: s to wait for the service, and for an arm that does not tell how a motion ended.
        action_timeout: s to wait for the response.
    """

    def __init__(
        self,
        services: ArmServices,
        on_report: Callable[[MotionReport], None],
        on_late_answer: Callable[[MotionReport], None],
        arm_wait: float,
        action_timeout: float,
        health: ArmHealth | None = None,
    ) -> None:
        """health: of the arm; None: an arm that has no heartbeats."""
        self.arm_wait = arm_wait
        self.action_timeout = action_timeout
        self._services = services
        self._on_report = on_report
        self._on_late_answer = on_late_answer
        self._health = health or NeverHeard()
        self._call: _Call | None = None

    @property
    def busy(self) -> bool:
        """Whether a call is pending."""
        return self._call is not None

    @property
    def ready(self) -> bool:
        """Whether the arm service is available."""
        return self._services.execute.service_is_ready()

    def start(self, motion_id: str, request: Callable[[], Any], now: float) -> None:
        """Start a call; `request` is built when the service is available.

        request: may raise NotSentError.
        """
        self._begin(_Call(motion_id, request, now))
        self.poll(now)

    def resume(self, motion_id: str, now: float) -> None:
        """Find out how a motion ended that an earlier run of this process requested."""
        self._begin(_Call(motion_id, lambda: None, now, sent=now, restored=True))

    def poll(self, now: float) -> None:
        """Send the pending request when the service is available; end the call on a timeout."""
        call = self._call
        if call is None:
            return
        if call.sent is None:
            self._send(call, now)
        else:
            self._watch(call, call.sent, now)

    def _begin(self, call: _Call) -> None:
        if self._call is not None:
            raise ValueError(
                f'Expected no call under way, got one since {self._call.started:g} s.'
            )
        self._call = call

    def _send(self, call: _Call, now: float) -> None:
        if not self.ready:
            if now - call.started >= self.arm_wait:
                self._fail(f'the arm service was not there within {self.arm_wait:g} s.')
            return
        try:
            request = call.request()
        except NotSentError as error:
            self._fail(f'the arm was not asked: {error}')
            return
        call.sent, call.run = now, self._health.run
        future = self._services.execute.call_async(request)
        future.add_done_callback(lambda done: self._on_response(call, done))

    def _watch(self, call: _Call, sent: float, now: float) -> None:
        """Ask the arm about a motion whose response may not come, and give up in the end."""
        why = self._doubt(call, sent, now)
        unconfirmed = call.run and not call.confirmed and now - sent >= self.arm_wait
        if (why or unconfirmed) and self._may_ask(call, now):
            self._ask(call, now)
        if not why:
            call.doubted = call.told = None
            return
        if call.doubted is None:
            call.doubted = now
        heard = bool(self._health.run) or call.restored
        patience = self.arm_wait if heard or call.asked is not None else 0.0
        if self._call is call and now - max(call.doubted, call.told or 0.0) >= patience:
            # Of an arm that reports nothing of itself no more is known than that it is gone.
            outcome = MotionOutcome.LOST if heard else None
            self._end(MotionReport(outcome, why))

    def _may_ask(self, call: _Call, now: float) -> bool:
        due = call.asked is None or now - call.asked >= STATUS_PERIOD
        return due and self._services.status.service_is_ready()

    def _doubt(self, call: _Call, sent: float, now: float) -> str:
        """Why the response may not come; empty: it may."""
        health, after = self._health, now - sent
        if self.ready:
            call.absent = None
        elif call.absent is None:
            call.absent = now
        if call.restored:
            return 'the inference node was restarted, and the arm does not say how it ended.'
        if call.repeated:
            return 'the arm had this request before, and does not say how it ended.'
        if call.run and health.run != call.run:
            return f'the arm was restarted within {after:.1f} s, and does not say how it ended.'
        if health.silence(now) >= SILENCE_TIMEOUT and call.run:
            return f'the arm has been silent for {health.silence(now):.1f} s.'
        if call.absent is not None and now - call.absent >= ABSENCE_TIMEOUT:
            return f'the arm service vanished {call.absent - sent:.1f} s after the request.'
        if after >= self.action_timeout:
            return f'the arm gave no answer within {self.action_timeout:g} s.'
        return ''

    def _ask(self, call: _Call, now: float) -> None:
        call.asked = now
        request = self._services.status_request(call.motion_id)
        future = self._services.status.call_async(request)
        future.add_done_callback(lambda done: self._on_status(call, now, done))

    def _on_status(self, call: _Call, asked: float, future: Future) -> None:
        state, report = self._services.read_status(future.result())
        if call is not self._call or call.sent is None:
            return
        if state is MotionState.ENDED:
            self._end(report)
        elif state is MotionState.UNKNOWN:
            call.told = asked
            call.unknown = asked if call.unknown is None else call.unknown
            if asked - call.unknown >= UNKNOWN_FOR:
                self._fail('the arm never got the request, nothing moved.')
        elif asked - call.sent < self.action_timeout:
            call.told, call.unknown, call.confirmed = asked, None, True

    def _on_response(self, call: _Call, future: Future) -> None:
        report = self._services.read_answer(future.result())
        if call is not self._call:
            self._on_late_answer(report)
        elif report.outcome is MotionOutcome.REPEATED:
            call.repeated = True
        else:
            self._end(report)

    def _fail(self, message: str) -> None:
        self._end(MotionReport(None, message))

    def _end(self, report: MotionReport) -> None:
        self._call = None
        self._on_report(report)

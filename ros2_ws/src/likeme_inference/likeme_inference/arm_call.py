"""One call to the arm that always ends: answered, absent, died or silent, and never made twice.

Plain Python against any client with rclpy's three methods, so that tests can pass a fake. Time is
steady seconds, handed in.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

from likeme_inference.tabletop.values import MotionReport


class Future(Protocol):
    """What call_async gives."""

    def add_done_callback(self, callback: Callable[[Any], None]) -> Any:
        """Call back when the answer is there."""

    def result(self) -> Any:
        """Give the answer."""


class Client(Protocol):
    """What is needed of a service client."""

    def service_is_ready(self) -> bool:
        """Whether a server is matched."""

    def call_async(self, request: Any) -> Future:
        """Send a request."""


@dataclass
class _Call:
    """A call that waits: for the service while not sent, else for the answer."""

    request: Callable[[], Any]
    asked: float
    sent: float | None = None


class ArmCall:
    """Sends at most one request at a time and reports each exactly once, by `on_report`.

    Attributes:
        arm_wait: s to wait for the service before giving up.
        action_timeout: s to wait for the answer before giving up.
    """

    def __init__(
        self,
        client: Client,
        read_answer: Callable[[Any], MotionReport],
        on_report: Callable[[MotionReport], None],
        on_late_answer: Callable[[MotionReport], None],
        arm_wait: float,
        action_timeout: float,
    ) -> None:
        self.arm_wait = arm_wait
        self.action_timeout = action_timeout
        self._client = client
        self._read_answer = read_answer
        self._on_report = on_report
        self._on_late_answer = on_late_answer
        self._call: _Call | None = None

    @property
    def busy(self) -> bool:
        """Whether a call waits for its end."""
        return self._call is not None

    @property
    def ready(self) -> bool:
        """Whether the arm's service is there."""
        return self._client.service_is_ready()

    def start(self, request: Callable[[], Any], now: float) -> None:
        """Begin a call; `request` is built when the service is there."""
        if self._call is not None:
            raise ValueError(f'Expected no call under way, got one since {self._call.asked:g} s.')
        self._call = _Call(request, now)
        self.poll(now)

    def poll(self, now: float) -> None:
        """Send what waits for the service, and give up what has waited too long."""
        call, ready = self._call, self._client.service_is_ready()
        if call is None:
            return
        if call.sent is None and ready:
            call.sent = now
            future = self._client.call_async(call.request())
            future.add_done_callback(lambda done: self._answered(call, done))
        elif call.sent is None and now - call.asked >= self.arm_wait:
            self._fail(f'the arm service was not there within {self.arm_wait:g} s.')
        elif call.sent is not None and not ready:
            self._fail(f'the arm service vanished {now - call.sent:.1f} s after the request.')
        elif call.sent is not None and now - call.sent >= self.action_timeout:
            self._fail(f'the arm gave no answer within {self.action_timeout:g} s.')

    def _answered(self, call: _Call, future: Future) -> None:
        report = self._read_answer(future.result())
        if call is not self._call:
            self._on_late_answer(report)
            return
        self._call = None
        self._on_report(report)

    def _fail(self, message: str) -> None:
        self._call = None
        self._on_report(MotionReport(None, message))

"""A call to the arm service that ends exactly once and is never repeated.

Plain Python against any client with rclpy's methods, so that tests can pass a fake. Times are s of
a monotonic clock, passed in.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

from likeme_inference.tabletop.values import MotionReport

#: s for which the service must be absent during a call before the call is given up. While another
#: server is being discovered, the service is reported as not ready for a moment.
ABSENCE_TIMEOUT = 1.0


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


@dataclass
class _Call:
    """A pending call: waits for the service until `sent`, then for the response."""

    request: Callable[[], Any]
    started: float
    sent: float | None = None
    absent: float | None = None


class ArmCall:
    """Sends at most one request at a time and reports each exactly once, by `on_report`.

    Attributes:
        arm_wait: s to wait for the service.
        action_timeout: s to wait for the response.
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
        """Whether a call is pending."""
        return self._call is not None

    @property
    def ready(self) -> bool:
        """Whether the arm service is available."""
        return self._client.service_is_ready()

    def start(self, request: Callable[[], Any], now: float) -> None:
        """Start a call; `request` is built when the service is available."""
        if self._call is not None:
            raise ValueError(
                f'Expected no call under way, got one since {self._call.started:g} s.'
            )
        self._call = _Call(request, now)
        self.poll(now)

    def poll(self, now: float) -> None:
        """Send the pending request when the service is available; end the call on a timeout."""
        call, ready = self._call, self._client.service_is_ready()
        if call is None:
            return
        if call.sent is None and ready:
            call.sent = now
            future = self._client.call_async(call.request())
            future.add_done_callback(lambda done: self._on_response(call, done))
        elif call.sent is None and now - call.started >= self.arm_wait:
            self._fail(f'the arm service was not there within {self.arm_wait:g} s.')
        elif call.sent is not None:
            if ready:
                call.absent = None
            elif call.absent is None:
                call.absent = now
            if call.absent is not None and now - call.absent >= ABSENCE_TIMEOUT:
                after = call.absent - call.sent
                self._fail(f'the arm service vanished {after:.1f} s after the request.')
            elif now - call.sent >= self.action_timeout:
                self._fail(f'the arm gave no answer within {self.action_timeout:g} s.')

    def _on_response(self, call: _Call, future: Future) -> None:
        report = self._read_answer(future.result())
        if call is not self._call:
            self._on_late_answer(report)
            return
        self._call = None
        self._on_report(report)

    def _fail(self, message: str) -> None:
        self._call = None
        self._on_report(MotionReport(None, message))

"""Policies of the nodes' lives."""

from __future__ import annotations

from typing import Any

from likeme_core.heartbeats import NodeState
from likeme_replay.policies.policy import Bounds, Found, Policy
from likeme_replay.policies.seen import Recent, Seen


class HeartbeatsCountUp(Policy):
    """Within one run of a node, the numbers of its heartbeats grow."""

    def __init__(self, seen: Seen, bounds: Bounds) -> None:
        super().__init__(seen, bounds)
        self._last: Recent[int] = Recent(100)

    def on_heartbeat(self, message: Any, _: float) -> Found:
        key, number = (message.node, message.run), int(message.sequence)
        if number <= self._last.get(key, 0):
            yield f'Expected a heartbeat after {self._last[key]} of {message.node}, got {number}.'
        self._last[key] = number


class EndedRunsStayEnded(Policy):
    """After a new run of a node the one before is not heard again: no node is there twice."""

    def __init__(self, seen: Seen, bounds: Bounds) -> None:
        super().__init__(seen, bounds)
        self._run: Recent[str] = Recent(100)
        self._ended: Recent[bool] = Recent(1000)

    def on_heartbeat(self, message: Any, _: float) -> Found:
        if message.run in self._ended:
            yield f'Expected one run of {message.node}, got {message.run} beside a later one.'
            return
        before = self._run.get(message.node)
        if before not in (None, message.run):
            self._ended[before] = True
        self._run[message.node] = message.run


class DeadNodesComeBack(Policy):
    """A node that falls silent without saying that it ends is heard again within a bound."""

    def __init__(self, seen: Seen, bounds: Bounds) -> None:
        super().__init__(seen, bounds)
        self._heard: Recent[float] = Recent(100)

    def on_heartbeat(self, message: Any, now: float) -> Found:
        if message.state == NodeState.ENDING:
            self._heard.pop(message.node, None)
        else:
            self._heard[message.node] = now
        yield from ()

    def tick(self, now: float) -> Found:
        bound = self.bounds.silence + self.bounds.recovery
        for node in [name for name, heard in self._heard.items() if now - heard > bound]:
            silence = now - self._heard.pop(node)
            yield f'Expected {node} again, got nothing for {silence:.1f} s.'


class OneVersion(Policy):
    """All nodes run the same version of the software."""

    def __init__(self, seen: Seen, bounds: Bounds) -> None:
        super().__init__(seen, bounds)
        self._version: str | None = None

    def on_heartbeat(self, message: Any, _: float) -> Found:
        known, self._version = self._version, message.version
        if known not in (None, message.version):
            yield f'Expected version {known}, got {message.version} of {message.node}.'


class ReasonsAreGiven(Policy):
    """A node that is not ready says why."""

    def on_heartbeat(self, message: Any, _: float) -> Found:
        if message.state in (NodeState.STARTING, NodeState.DEGRADED) and not message.message:
            yield f'Expected why {message.node} is not ready, got nothing.'

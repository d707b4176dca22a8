"""Whether the nodes of the cell are alive, from their heartbeats.

Times are s of a monotonic clock, passed in.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum, StrEnum

#: s between two heartbeats of a node.
HEARTBEAT_PERIOD = 0.05
#: s without a heartbeat after which a node counts as silent. Five periods: on a loaded machine
#: single heartbeats are late.
HEARTBEAT_TIMEOUT = 0.25


class NodeState(IntEnum):
    """What a node can do; the numbers of likeme_msgs/Heartbeat."""

    STARTING = 0
    READY = 1
    DEGRADED = 2
    ENDING = 3


def described(state: NodeState, message: str) -> str:
    """State and reason in one phrase, e.g. `starting: no camera_info has come yet`."""
    return state.name.lower() + (f': {message}' if message else '')


class Change(StrEnum):
    """What a heartbeat tells beyond that the node is alive."""

    FIRST = 'first'
    RESTARTED = 'restarted'
    BACK = 'back'


@dataclass
class NodeRecord:
    """What is known of one node.

    Attributes:
        run: id of the process's run.
        heard: time of the last heartbeat, s.
        state, message, version: of the last heartbeat.
        restarts: runs heard after the first one.
    """

    run: str
    heard: float
    state: NodeState = NodeState.STARTING
    message: str = ''
    version: str = ''
    restarts: int = 0


class HeartbeatMonitor:
    """Keeps the last heartbeat of every node.

    Attributes:
        nodes: by fully qualified name.
    """

    def __init__(self, timeout: float = HEARTBEAT_TIMEOUT) -> None:
        self.nodes: dict[str, NodeRecord] = {}
        self._timeout = timeout
        # A killed run's last heartbeat may arrive after the first one of the next run.
        self._ended_runs: set[str] = set()

    def hear(
        self, name: str, run: str, now: float, state: int = NodeState.READY, message: str = '',
        version: str = '',
    ) -> Change | None:  # fmt: skip
        """Take in a heartbeat; what it tells, None if only that the node is still alive."""
        known = self.nodes.get(name)
        if run in self._ended_runs:
            return None
        health = NodeState(state) if state in set(NodeState) else NodeState.DEGRADED
        if known is None:
            self.nodes[name] = NodeRecord(run, now, health, message, version)
            return Change.FIRST
        silent = now - known.heard > self._timeout
        restarted = run != known.run
        if restarted:
            self._ended_runs.add(known.run)
            known.run, known.restarts = run, known.restarts + 1
        known.heard, known.state, known.message, known.version = now, health, message, version
        if restarted:
            return Change.RESTARTED
        return Change.BACK if silent else None

    def alive(self, name: str, now: float) -> bool:
        """Whether a node was heard within the timeout."""
        known = self.nodes.get(name)
        return known is not None and now - known.heard <= self._timeout

    def silence(self, name: str, now: float) -> float:
        """Seconds since a node was heard; infinite if it never was."""
        known = self.nodes.get(name)
        return float('inf') if known is None else now - known.heard

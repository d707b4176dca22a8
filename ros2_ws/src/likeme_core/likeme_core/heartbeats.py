"""Whether the nodes of the cell are alive, from their heartbeats.

Times are s of a monotonic clock, passed in.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

#: s between two heartbeats of a node.
HEARTBEAT_PERIOD = 0.05
#: s without a heartbeat after which a node counts as silent. Five periods: on a loaded machine
#: single heartbeats are late.
HEARTBEAT_TIMEOUT = 0.25
#: s without a message of the hold keeper after which nothing moves, unless a driver has another
#: `hold_timeout`: six of the keeper's periods.
HOLD_TIMEOUT = 0.3


class NodeState(IntEnum):
    """What a node can do; the numbers of likeme_msgs/Heartbeat."""

    STARTING = 0
    READY = 1
    DEGRADED = 2
    ENDING = 3


def described(state: NodeState, message: str) -> str:
    """State and reason in one phrase, e.g. `starting: no camera_info has come yet`."""
    return state.name.lower() + (f': {message}' if message else '')


@dataclass(frozen=True)
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

    def __init__(self) -> None:
        self.nodes: dict[str, NodeRecord] = {}
        # A killed run's last heartbeat may arrive after the first one of the next run.
        self._ended_runs: set[str] = set()

    def hear(
        self, name: str, run: str, now: float, state: int = NodeState.READY, message: str = '',
        version: str = '',
    ) -> None:  # fmt: skip
        """Take in a heartbeat."""
        if run in self._ended_runs:
            return
        health = NodeState(state) if state in set(NodeState) else NodeState.DEGRADED
        restarts, known = 0, self.nodes.get(name)
        if known is not None:
            restarts = known.restarts + (run != known.run)
            if run != known.run:
                self._ended_runs.add(known.run)
        self.nodes[name] = NodeRecord(run, now, health, message, version, restarts)

    def alive(self, name: str, now: float) -> bool:
        """Whether a node was heard within HEARTBEAT_TIMEOUT."""
        return self.silence(name, now) <= HEARTBEAT_TIMEOUT

    def silence(self, name: str, now: float) -> float:
        """Seconds since a node was heard; infinite if it never was."""
        known = self.nodes.get(name)
        return float('inf') if known is None else now - known.heard

"""What the perception node can do, from the frames that come."""

from __future__ import annotations

from likeme_core.heartbeats import NodeState
from likeme_perception.frame_reader import FrameReader

#: s without a frame that could be read after which the node is DEGRADED.
FRAME_TIMEOUT = 1.0


class FrameHealth:
    """State of the node for its heartbeat. Times are s of a monotonic clock, passed in."""

    def __init__(self, now: float) -> None:
        self._read_at = now
        self._dropped = ''

    def read(self, now: float) -> None:
        """A frame was read."""
        self._read_at, self._dropped = now, ''

    def drop(self, sentence: str) -> None:
        """A frame was dropped."""
        self._dropped = sentence

    def state(self, reader: FrameReader, now: float) -> tuple[NodeState, str]:
        """The state, and why it is not READY."""
        silent = now - self._read_at > FRAME_TIMEOUT
        why = self._dropped or f'no frame has come for {now - self._read_at:.0f} s'
        if reader.background_learned:
            unknown = f'all states are unknown: {reader.reason}' if reader.reason else ''
            why = why if silent else unknown
            return (NodeState.DEGRADED, why) if why else (NodeState.READY, '')
        if reader.intrinsics is None:
            return NodeState.STARTING, self._dropped or 'no camera_info has come yet'
        return NodeState.STARTING, why if silent else _learning(reader)


def _learning(reader: FrameReader) -> str:
    restarts = reader.perception.restarts if reader.perception else 0
    again = f', something moved: begun anew {restarts} times' if restarts else ''
    return f'the background is learned{again}'

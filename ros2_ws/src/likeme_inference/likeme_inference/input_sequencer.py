"""Inputs that wait for their cue: how a replay makes a session take in the same things again.

Topics come over the network in no order among each other, and a robot's or an operator's answer
comes when it likes. A recorded run is a list of cues; in a rehearsal what arrives waits here until
its cue is the next one, so that the order is the list's and nothing else's. No ROS.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from enum import IntEnum
from typing import Any, NamedTuple


class Input(IntEnum):
    """What a session takes in; the numbers of likeme_msgs/Heard."""

    TABLE_STATE = 0
    DEMONSTRATION = 1
    MOTION = 2
    ANSWER = 3
    SILENCE = 4
    NOTHING = 5

    @property
    def comes_by_topic(self) -> bool:
        """Whether a message of its own has to arrive first."""
        return self <= Input.DEMONSTRATION


class Cue(NamedTuple):
    """The next thing to take in; `stamp` (ns) names the message, `said` is the cue's own one."""

    kind: Input
    stamp: int
    said: Any


class Rehearsal:
    """Holds messages back until their cue, while it is on; passes them on at once while not.

    Attributes:
        on: whether inputs wait for cues.
    """

    def __init__(self, on: bool = False) -> None:
        self.begin(on)

    def begin(self, on: bool) -> None:
        """Forget all cues and messages, and hold back from now on, or not."""
        self.on = on
        self._cues: deque[Cue] = deque()
        self._waiting: dict[tuple[Input, int], deque[Any]] = {}

    def gate(
        self, kind: Input, stamp_of: Callable[[Any], int], take: Callable[[Any], None],
        play: Callable[[], None],
    ) -> Callable[[Any], None]:  # fmt: skip
        """A subscription's callback: `take` the message, or keep it and `play` what is ready."""

        def arrived(message: Any) -> None:
            if not self.on:
                take(message)
                return
            self._waiting.setdefault((kind, stamp_of(message)), deque()).append(message)
            play()

        return arrived

    def add(self, cue: Cue) -> None:
        """Put a cue at the end of the list."""
        self._cues.append(cue)

    def ready(self) -> Iterator[tuple[Cue, Any]]:
        """Cues whose turn it is, each with its message (None where it has none of its own)."""
        while self._cues:
            cue = self._cues[0]
            if not cue.kind.comes_by_topic:
                yield self._cues.popleft(), None
                continue
            messages = self._waiting.get((cue.kind, cue.stamp))
            if not messages:
                return
            message = messages.popleft()
            # What is older than this never gets a cue any more.
            self._waiting = {
                key: kept
                for key, kept in self._waiting.items()
                if kept and (key[0] is not cue.kind or key[1] >= cue.stamp)
            }
            yield self._cues.popleft(), message

"""Whether a driver may move its motors, from what it hears of the hold keeper.

Every driver has one and asks it at every control step. Motion needs the consent of a keeper that
is heard now: a driver that hears nobody does not move.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from enum import Enum, auto

from likeme_core.heartbeats import HOLD_TIMEOUT


class Block(Enum):
    """Why nothing may move."""

    #: The keeper says so.
    HELD = auto()
    #: Stopped directly; the keeper has not said yet that it has taken the stop over.
    STOPPED = auto()
    #: The keeper is not heard, was never heard, or has forgotten the last hold or resume.
    UNHEARD = auto()

    @property
    def sentence(self) -> str:
        """For people."""
        return _SENTENCES[self]


_SENTENCES = {
    Block.HELD: 'The cell is held: nothing moves until it is resumed.',
    Block.STOPPED: 'The cell was stopped: nothing moves until it is resumed.',
    Block.UNHEARD: 'The hold keeper is not heard: nothing moves until it is.',
}


class HoldMonitor:
    """What a driver knows of the hold. Every method may be called from any thread."""

    def __init__(
        self, timeout: float = HOLD_TIMEOUT, clock: Callable[[], float] = time.monotonic
    ) -> None:
        """timeout: longest time between two messages of the keeper, s. clock: monotonic, s."""
        self._timeout, self._clock = timeout, clock
        self._lock = threading.Lock()
        self._held, self._stopped = True, False
        self._change = 0
        self._heard: float | None = None

    def hear(self, held: bool, change: int, age: float = 0.0) -> None:
        """Take in a state of the keeper.

        Args:
            held: nothing may move.
            change: number of the last hold or resume, see likeme_msgs/HoldState. A smaller one
                than heard before comes from a keeper that has lost its memory, or from a second
                one: it is no consent.
            age: time since its arrival, s: one that waited is no sign that the keeper lives.
        """
        with self._lock:
            if change < self._change:
                return
            # A state that was sent before the stop arrived there does not end the stop.
            if held and change > self._change:
                self._stopped = False
            self._held, self._change = held, change
            arrived = self._clock() - age
            self._heard = arrived if self._heard is None else max(arrived, self._heard)

    def stop(self) -> None:
        """Block at once, until the keeper has held and then resumed."""
        with self._lock:
            self._stopped = True

    @property
    def block(self) -> Block | None:
        """Why nothing may move; None: motion is allowed."""
        with self._lock:
            if self._stopped:
                return Block.STOPPED
            if self._heard is None:
                return Block.UNHEARD
            if self._held:
                return Block.HELD
            silent = self._clock() - self._heard > self._timeout
            return Block.UNHEARD if silent else None

    @property
    def change(self) -> int:
        """Number of the last hold or resume that was heard: tells of a hold that is over."""
        with self._lock:
            return self._change

    @property
    def unconfirmed(self) -> bool:
        """Whether a stop has not been taken over by the keeper yet."""
        return self._stopped

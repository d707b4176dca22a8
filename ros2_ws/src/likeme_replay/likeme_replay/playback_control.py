"""When the next thing of a recording is due: rate, pause, and single steps by key."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterable

from likeme_bags.sampling import MAX_STEP

#: s between two looks at the keyboard.
GLANCE = 0.05


class EndedByKeyError(Exception):
    """Somebody pressed q."""


class Transport:
    """Lets a player wait until a stamp is due.

    Steps of more than an hour are left out: the clock was set while the bag was recorded.

    Attributes:
        rate: recorded s per s; 0: as fast as it goes.
        paused: whether nothing is due until a key is pressed.
    """

    def __init__(
        self,
        rate: float = 1.0,
        paused: bool = False,
        keys: Callable[[], Iterable[str]] = tuple,
        now: Callable[[], float] = time.monotonic,
        say: Callable[[str], None] = lambda sentence: None,
    ) -> None:
        """`keys` gives the keys pressed since it was asked last; `now` is a steady clock, s.

        say: takes the sentences for the user.
        """
        self.rate, self.paused = rate, paused
        self._keys, self._now, self._say = keys, now, say
        self._last = 0
        self._began: tuple[float, int] | None = None
        self._pressed: deque[str] = deque()
        self._step = False

    def restart(self) -> None:
        """Count from the next stamp on."""
        self._began = None

    def wait(self, stamp: int, idle: Callable[[float], None]) -> None:
        """Return when `stamp` (ns) is due; `idle` is called meanwhile with s to spend.

        Raises:
            EndedByKeyError: by the key q.
        """
        self._listen()
        if self._began is not None and self.rate > 0 and stamp - self._last > MAX_STEP:
            self._say(f'The bag jumps by {(stamp - self._last) / 1e9:.0f} s; left out.')
            self._began = None
        self._last = stamp
        if self._began is None:
            self._began = self._now(), stamp
        while self.paused and not self._step:
            idle(GLANCE)
            self._listen()
            # However long the pause was, what comes next is due at once.
            self._began = self._now(), stamp
        if self._step:
            self._step = False
            return
        while self.rate > 0 and not self.paused:
            left = self._due(stamp) - self._now()
            if left <= 0:
                return
            idle(min(left, GLANCE))
            self._listen()
        if self.paused:
            self.wait(stamp, idle)

    def _due(self, stamp: int) -> float:
        assert self._began is not None, 'Counting began with the first stamp.'
        wall, first = self._began
        return wall + (stamp - first) * 1e-9 / self.rate

    def _listen(self) -> None:
        self._pressed.extend(self._keys())
        # A step is taken before the next key counts.
        while self._pressed and not self._step:
            key = self._pressed.popleft()
            if key == 'q':
                raise EndedByKeyError
            if key == ' ':
                self.paused = not self.paused
            elif key == 'n':
                self.paused = self._step = True

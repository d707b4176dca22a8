"""When the next message of a recording is due: rate, pause, and single steps by key."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterable

#: s between two reads of the keyboard.
KEY_POLL_PERIOD = 0.05
#: Gaps between stamps, s: a longer one is announced; a longer one is left out, because the clock
#: was set while the bag was recorded. Stamps that go back by more than this also mean that.
ANNOUNCED_GAP = 10.0
MAX_GAP = 3600.0
MAX_STEP_BACK = 1.0


class EndedByKeyError(Exception):
    """The user pressed q."""


class PlaybackControl:
    """Lets a player wait until a stamp is due.

    Attributes:
        rate: recorded s per s; 0: as fast as possible.
        paused: nothing is due until a key is pressed.
    """

    def __init__(
        self,
        rate: float = 1.0,
        paused: bool = False,
        keys: Callable[[], Iterable[str]] = tuple,
        now: Callable[[], float] = time.monotonic,
        notify: Callable[[str], None] = lambda sentence: None,
    ) -> None:
        """`keys` returns the keys pressed since its last call; `now` is a steady clock, s.

        notify: takes messages for the user.
        """
        self.rate, self.paused = rate, paused
        self._keys, self._now, self._notify = keys, now, notify
        #: Time of the clock at which a stamp was due: others are due relative to it.
        self._reference: tuple[float, int] | None = None
        self._last: int | None = None
        self._pressed: deque[str] = deque()
        self._step = False

    def restart(self) -> None:
        """Play the next stamp at once, and later ones relative to it."""
        self._reference = self._last = None

    def wait(self, stamp: int, idle: Callable[[float], None]) -> None:
        """Return when `stamp` (ns) is due; `idle` is called meanwhile with s to spend.

        Raises:
            EndedByKeyError: by the key q.
        """
        self._read_keys()
        self._skip_gap(stamp)
        if self._reference is None:
            self._reference = self._now(), stamp
        while self.paused and not self._step:
            idle(KEY_POLL_PERIOD)
            self._read_keys()
            # After a pause, however long, the next message is due at once.
            self._reference = self._now(), stamp
        if self._step:
            self._step = False
            return
        while self.rate > 0 and not self.paused:
            left = self._due(stamp) - self._now()
            if left <= 0:
                return
            idle(min(left, KEY_POLL_PERIOD))
            self._read_keys()
        if self.paused:
            self.wait(stamp, idle)

    def _skip_gap(self, stamp: int) -> None:
        """Leave out jumps of the recorded clock; announce long waits."""
        gap = 0.0 if self._last is None else (stamp - self._last) * 1e-9
        self._last = stamp
        if self.rate <= 0:
            return
        if gap > MAX_GAP or gap < -MAX_STEP_BACK:
            self._notify(f'The recorded clock jumps by {gap:.0f} s; the jump is left out.')
            self._reference = None
        elif gap / self.rate > ANNOUNCED_GAP and not self.paused:
            self._notify(f'The next message is due in {gap / self.rate:.0f} s.')

    def _due(self, stamp: int) -> float:
        assert self._reference is not None, 'The first stamp is the reference.'
        at, reference = self._reference
        return at + (stamp - reference) * 1e-9 / self.rate

    def _read_keys(self) -> None:
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

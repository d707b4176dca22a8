"""Policies of the latched hold, and of the joints while it holds."""

from __future__ import annotations

from typing import Any

from likeme_replay.policies.policy import Bounds, Expectant, Found, Policy
from likeme_replay.policies.seen import Recent, Seen


class HoldsOnlyGrow(Policy):
    """The number of the last hold or resume never falls, also across restarts of the keeper."""

    def on_cell_hold_state(self, message: Any, _: float) -> Found:
        before = self.seen.hold
        if before is not None and message.change < before.change:
            yield f'Expected a change from {before.change} on, got {message.change}.'


class HoldIsLatched(Policy):
    """Held and resumed follow each other by a change with a greater number, never by itself."""

    def on_cell_hold_state(self, message: Any, _: float) -> Found:
        before = self.seen.hold
        flipped = before is not None and before.held != message.held
        if flipped and message.change == before.change:
            yield f'Expected held {before.held} until the next change, got {message.held}.'


class HoldsSayTheSame(Policy):
    """A change of the hold is reported with the same content wherever and whenever it is told."""

    def __init__(self, seen: Seen, bounds: Bounds) -> None:
        super().__init__(seen, bounds)
        self._told: Recent[tuple[bool, str]] = Recent(100)

    def on_cell_holds(self, message: Any, _: float) -> Found:
        what = (bool(message.held), str(message.by))
        known = self._told.setdefault(int(message.change), what)
        if known != what:
            yield f'Expected change {message.change} to be {known}, got {what}.'


class HoldsAreTold(Expectant):
    """Every change of the state is reported on `cell/holds` within a bound."""

    def __init__(self, seen: Seen, bounds: Bounds) -> None:
        super().__init__(seen, bounds)
        self._told: Recent[bool] = Recent(100)

    def on_cell_holds(self, message: Any, _: float) -> Found:
        self._told[int(message.change)] = True
        self._expected.meet(int(message.change))
        yield from ()

    def on_cell_hold_state(self, message: Any, now: float) -> Found:
        before, change = self.seen.hold, int(message.change)
        if before is not None and change > before.change and change not in self._told:
            sentence = f'Expected change {change} on cell/holds by now, got none.'
            self._expected.expect(change, now + self.bounds.told, sentence)
        yield from ()


class KeeperComesBack(Policy):
    """A hold keeper that falls silent is heard again within a bound."""

    def __init__(self, seen: Seen, bounds: Bounds) -> None:
        super().__init__(seen, bounds)
        self._reported = False

    def on_cell_hold_state(self, message: Any, _: float) -> Found:
        self._reported = False
        yield from ()

    def tick(self, now: float) -> Found:
        if self.seen.hold is None or self._reported:
            return
        silence = now - self.seen.hold_heard
        late = silence > self.bounds.silence + self.bounds.recovery
        if late and not self.seen.missed('cell/hold_state', now):
            self._reported = True
            yield f'Expected the hold keeper again, got nothing for {silence:.1f} s.'


class _JointCheck:
    """Judges joints from `Bounds.reaction` after they had to begin to stop.

    A driver that got no processor time stops in its next control step: after a pause of its
    joint states the time counts from the first one.
    """

    def __init__(self, bounds: Bounds) -> None:
        self._bounds = bounds
        self._last = self._runs_since = float('-inf')

    def moving(self, message: Any, now: float, stop: float | None, when: str) -> Found:
        """A violation if they move; stop: when they had to begin to stop, s, None: never."""
        if now - self._last > self._bounds.silence:
            self._runs_since = now
        self._last = now
        if stop is None or now - max(stop, self._runs_since) <= self._bounds.reaction:
            return
        speed = max((abs(float(v)) for v in message.velocity), default=0.0)
        if speed > self._bounds.joint_speed:
            yield f'Expected the joints at rest {when}, got {speed:.3f} rad/s.'


class JointsRestWhileHeld(Policy):
    """From a short time after a hold until it is resumed, every joint is at rest."""

    def __init__(self, seen: Seen, bounds: Bounds) -> None:
        super().__init__(seen, bounds)
        self._joints = _JointCheck(bounds)

    def on_joint_states(self, message: Any, now: float) -> Found:
        held = self.seen.hold is not None and self.seen.hold.held
        stop = self.seen.hold_changed if held else None
        yield from self._joints.moving(message, now, stop, 'while held')


class JointsRestUnheard(Policy):
    """While the hold keeper is not heard, every joint comes to rest and stays so."""

    def __init__(self, seen: Seen, bounds: Bounds) -> None:
        super().__init__(seen, bounds)
        self._joints = _JointCheck(bounds)

    def on_joint_states(self, message: Any, now: float) -> Found:
        known = self.seen.hold is not None and not self.seen.missed('cell/hold_state', now)
        stop = self.seen.hold_heard + self.bounds.keeper_silence if known else None
        yield from self._joints.moving(message, now, stop, 'without a hold keeper')

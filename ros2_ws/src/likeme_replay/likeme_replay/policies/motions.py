"""Policies of motions: what may begin one, how often, and that each one ends."""

from __future__ import annotations

from typing import Any

from likeme_core.heartbeats import NodeState
from likeme_core.stamps import stamp_ns
from likeme_replay.policies.motion_ids import decision_of
from likeme_replay.policies.policy import Bounds, Expectant, Found, Policy
from likeme_replay.policies.seen import (
    ASK_HUMAN,
    COMPLETED,
    ENDED,
    EXECUTE,
    LOST,
    ROBOT,
    TIME_JUMP,
    TRY_ANYWAY,
    UNDER_WAY,
    Recent,
    Seen,
)


class MotionsBeginOnce(Policy):
    """A motion begins at most once: no id is ever carried out again."""

    def on_motion(self, message: Any, _: float) -> Found:
        if message.state == UNDER_WAY and message.id in self.seen.motions:
            yield f'Expected the motion {message.id!r} to begin once, got it again.'


class MotionsEndOnce(Policy):
    """A motion ends once, after it began; one of a driver that was killed may end LOST alone."""

    def on_motion(self, message: Any, _: float) -> Found:
        if message.state != ENDED:
            return
        before = self.seen.motions.get(message.id)
        if before is None:
            if message.outcome != LOST:
                yield f'Expected the begin of the motion {message.id!r} before its end.'
        elif before.state == ENDED and before.outcome != message.outcome:
            outcomes = f'{before.outcome}, then {message.outcome}'
            yield f'Expected one outcome of the motion {message.id!r}, got {outcomes}.'


class MotionsEndInTime(Expectant):
    """Every motion that began ends within a bound, also where its driver is killed."""

    def on_motion(self, message: Any, now: float) -> Found:
        if message.state == ENDED:
            self._expected.meet(message.id)
        elif message.id not in self._expected:
            sentence = f'Expected the end of the motion {message.id!r} by now, got none.'
            self._expected.expect(message.id, now + self.bounds.motion, sentence)
        yield from ()


class OneMotionAtATime(Policy):
    """An actor begins no motion before its last one has ended."""

    def __init__(self, seen: Seen, bounds: Bounds) -> None:
        super().__init__(seen, bounds)
        self._under_way: dict[int, str] = {}

    def on_motion(self, message: Any, _: float) -> Found:
        before = self._under_way.get(message.actor)
        if message.state == UNDER_WAY:
            if before not in (None, message.id):
                yield f'Expected the end of the motion {before!r} first, got {message.id!r}.'
            self._under_way[message.actor] = message.id
        elif before == message.id:
            del self._under_way[message.actor]


class MotionsTakeTime(Policy):
    """A motion that has ended began before it ended, or moved nothing, and says how it ended."""

    def on_motion(self, message: Any, _: float) -> Found:
        if message.state != ENDED:
            return
        started, finished = stamp_ns(message.started), stamp_ns(message.finished)
        still = started == finished == 0 and message.outcome != COMPLETED
        began_anew = started - finished > TIME_JUMP
        if not still and not began_anew and not 0 < started <= finished:
            yield f'Expected a begin before the end, got {started} and {finished} ns.'
        if not message.message:
            yield f'Expected one sentence on the end of {message.id!r}, got none.'


class ActsOnDecisionsAlone(Policy):
    """The inference node moves the arm for a decision to act, or for an accepted "try anyway"."""

    def on_motion(self, message: Any, _: float) -> Found:
        number = decision_of(message.id)
        if message.state != UNDER_WAY or number is None:
            return
        decision = self.seen.decisions.get(number)
        if decision is None:
            if self.seen.decisions:
                yield f'Expected a decision {number} before its motion, got none.'
        elif decision.kind == ASK_HUMAN and self.seen.answers.get(number) != TRY_ANYWAY:
            # The answer is acknowledged on `heard` before the arm is asked.
            yield f'Expected an answer to try decision {number} before its motion, got none.'
        elif decision.kind not in (EXECUTE, ASK_HUMAN):
            yield f'Expected no motion for decision {number}, got one.'


class ActsAsDecided(Policy):
    """A motion of a decision moves its object by its action, and is the arm's."""

    def on_motion(self, message: Any, _: float) -> Found:
        decision = self.seen.decisions.get(decision_of(message.id))
        if message.state != UNDER_WAY or decision is None or self.seen.world is None:
            return
        actions = list(self.seen.world.actions)
        action = actions[decision.action] if decision.action < len(actions) else ''
        expected = (decision.object.lower(), action.lower(), ROBOT)
        got = (message.object.lower(), message.action.lower(), message.actor)
        if got != expected:
            yield f'Expected the motion {expected}, got {got}.'


class OneMotionADecision(Policy):
    """At most one motion begins for one decision."""

    def __init__(self, seen: Seen, bounds: Bounds) -> None:
        super().__init__(seen, bounds)
        self._begun: Recent[str] = Recent(100)

    def on_motion(self, message: Any, _: float) -> Found:
        number = decision_of(message.id)
        if message.state != UNDER_WAY or number is None:
            return
        if self._begun.setdefault(number, message.id) != message.id:
            got = f'{self._begun[number]!r} and {message.id!r}'
            yield f'Expected one motion of decision {number}, got {got}.'


class NoMotionAfterTheOutcome(Policy):
    """No motion begins for a decision that has its outcome."""

    def on_motion(self, message: Any, _: float) -> Found:
        number = decision_of(message.id)
        if message.state == UNDER_WAY and number in self.seen.outcomes:
            yield f'Expected no motion after the outcome of decision {number}, got one.'


class NoMotionBeginsWhileHeld(Policy):
    """A request that is accepted while the cell is held moves nothing until it is resumed."""

    def __init__(self, seen: Seen, bounds: Bounds) -> None:
        super().__init__(seen, bounds)
        self._blocked: set[str] = set()

    def on_cell_hold_state(self, message: Any, _: float) -> Found:
        if not message.held:
            self._blocked.clear()
        yield from ()

    def on_motion(self, message: Any, now: float) -> Found:
        hold = self.seen.hold
        if message.state == UNDER_WAY:
            if hold and hold.held and now - self.seen.hold_changed > self.bounds.reaction:
                self._blocked.add(message.id)
        elif message.id in self._blocked:
            self._blocked.discard(message.id)
            if stamp_ns(message.started):
                yield f'Expected nothing to move while held, got the motion {message.id!r}.'


class NoMotionBeginsUnheard(Policy):
    """A request that is accepted while no hold keeper is heard moves nothing until one is."""

    def __init__(self, seen: Seen, bounds: Bounds) -> None:
        super().__init__(seen, bounds)
        self._blocked: set[str] = set()

    def on_cell_hold_state(self, _message: Any, _: float) -> Found:
        self._blocked.clear()
        yield from ()

    def on_motion(self, message: Any, now: float) -> Found:
        if message.state == UNDER_WAY and self.seen.hold is not None:
            silence = now - self.seen.hold_heard
            missed = self.seen.missed('cell/hold_state', now)
            if silence > self.bounds.keeper_silence and not missed:
                self._blocked.add(message.id)
        elif message.id in self._blocked:
            self._blocked.discard(message.id)
            if stamp_ns(message.started):
                yield f'Expected a hold keeper before {message.id!r} moves, got none.'


class HeldMotionsEnd(Expectant):
    """A motion that was under way when the cell was held ends at once, held or complete.

    A driver that was not heard meanwhile, since it died or was cut off, tells it when it is heard
    again; that it is, is the matter of DeadNodesComeBack.
    """

    def __init__(self, seen: Seen, bounds: Bounds) -> None:
        super().__init__(seen, bounds)
        # When the driver was heard to run, s; None: this cell has no heartbeats.
        self._driver_ran: float | None = None

    def on_heartbeat(self, message: Any, now: float) -> Found:
        if message.node.endswith('/arm_driver') and message.state != NodeState.STARTING:
            if self._silent(now):
                self._expected.postpone(now + self.bounds.told)
            self._driver_ran = now
        yield from ()

    def on_cell_hold_state(self, message: Any, now: float) -> Found:
        if message.held and (self.seen.hold is None or not self.seen.hold.held):
            for motion in self.seen.motions.values():
                if motion.state == UNDER_WAY:
                    sentence = f'Expected the motion {motion.id!r} to end when held; it did not.'
                    self._expected.expect(motion.id, now + self.bounds.told, sentence)
        yield from ()

    def on_motion(self, message: Any, _: float) -> Found:
        if message.state == ENDED:
            self._expected.meet(message.id)
        yield from ()

    def tick(self, now: float) -> Found:
        """The sentences of what has not come, of a driver that runs."""
        if not self._silent(now):
            yield from super().tick(now)

    def _silent(self, now: float) -> bool:
        return self._driver_ran is not None and now - self._driver_ran > self.bounds.silence

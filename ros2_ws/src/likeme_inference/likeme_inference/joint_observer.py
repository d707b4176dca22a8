"""Watches a person's attempts and infers the joint goal after each, across demonstrations.

Time is the stamps of table states and attempts. No ROS, no clock, no thread.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from likeme_core.observations import ObservedAttempt, TableSnapshot
from likeme_core.tabletop import Manner, State
from likeme_core.world import World
from likeme_inference.joint_belief import MOST_TOLD, JointBelief, ToldEvent, told
from likeme_inference.tabletop.arrays import FloatArray
from likeme_inference.tabletop.attempts import Attempt, Stopped
from likeme_inference.tabletop.goal_test import GoalTest, simulated_statistic
from likeme_inference.tabletop.joint_goals import JointGoals
from likeme_inference.tabletop.joint_watcher import Watcher
from likeme_inference.tabletop.robot_model import RobotModel

#: Least probability of a manner that counts; and of a state that counts as certain.
SURE_MANNER, SURE_STATE = 0.9, 1 - 1e-6
#: The test of "none of these": its level, simulated demonstrations and their seed.
LEVEL, SIMULATED, SEED = 0.05, 500, 0
#: Changes of the table that are kept, attempts that wait for their table state.
_KEPT, _WAITING = 256, 20
#: ns by which a stamp must go back for time to have begun anew (a bag, a new cell).
_BACK = 1_000_000_000
#: ns after the last act of a demonstration in which another observer goes on with it.
_TAKEN_UP = 60_000_000_000


@dataclass(frozen=True)
class JointSettings:
    """Parameters.

    Attributes:
        largest: greatest number of joint goals; 0: none are inferred.
        stop_delay: s without an act after which the person has stopped.
        soft_evidence: whether perception's probabilities of states count.
    """

    largest: int = 255
    stop_delay: float = 5.0
    soft_evidence: bool = True


class JointObserver:
    """Turns table states and attempts into beliefs.

    A demonstration begins with the first attempt and has ended when there was none for
    `stop_delay`. What it tells of the person is the prior of the next one. Where an object was at
    its start is what the table states before it told last; of one that none told of, nothing is
    known. Of acts at the same time only one is taken in while it is under way, the others when
    they have ended.

    Attributes:
        settings: in force from the next input; `largest` from the next demonstration.
        model: from which the next demonstration is explained.
        watcher: of the present demonstration; None between two.
        belief: the latest; None before the first.
        person: P(kind of person), shape [person]; None before the first demonstration has ended.
        refusal: why no joint goals are inferred, in a sentence; empty if they are.
    """

    def __init__(self, world: World, model: RobotModel, settings: JointSettings) -> None:
        self._world, self.model, self.settings = world, model, settings
        self.person: FloatArray | None = None
        self.belief: JointBelief | None = None
        self.refusal = ''
        self._made: tuple[RobotModel, int] | None = None
        self._goals: JointGoals | None = None
        self.restart()

    def restart(self) -> None:
        """Forget the table and the demonstration; what is known of the person stays."""
        self.watcher: Watcher | None = None
        self._seen: list[ObservedAttempt] = []
        self._start: Mapping[str, State] = {}
        self._open: str | None = None
        self._ended_meanwhile: list[ObservedAttempt] = []
        self._acted = self._last = 0
        self._taken_up = False
        self._waiting: deque[ObservedAttempt] = deque(maxlen=_WAITING)
        self._tables: deque[tuple[int, Mapping[str, State]]] = deque(maxlen=_KEPT)

    def look(self, table: TableSnapshot) -> list[JointBelief]:
        """Take in a table state; the beliefs of attempts that waited for it, and of a stop."""
        late = self._taken_up and table.stamp > self._acted + _TAKEN_UP
        if table.stamp < self._last - _BACK or late:
            self.restart()
        self._taken_up = False
        self._prepare()
        if self._goals is None:
            return []
        found: list[JointBelief] = []
        while self._waiting and self._waiting[0].stamp <= table.stamp:
            found += self._take(self._waiting.popleft())
        quiet = table.stamp - self._acted >= self.settings.stop_delay * 1e9
        # Nobody has stopped whose hand is in view.
        if self.watcher is not None and quiet and table.settled:
            found.append(self._stop(table.stamp, table.frame))
        self._remember(table.stamp, {**self._known, **table.states})
        self._last = max(self._last, table.stamp)
        return found

    def see(self, attempt: ObservedAttempt) -> list[JointBelief]:
        """Take in an attempt, when its table state has been; the beliefs that follow.

        Raises:
            ValueError: the world has no such object.
        """
        if attempt.object not in self._world.objects:
            raise ValueError(
                f'Expected one of {", ".join(self._world.objects)}, got {attempt.object!r}.'
            )
        if attempt.stamp > self._last:
            self._waiting.append(attempt)
            return []
        return [] if self._goals is None else self._take(attempt)

    def take_up(self, events: Sequence[ToldEvent]) -> JointBelief | None:
        """Go on with the newest demonstration of an observer that is gone.

        Not if the first table state comes more than a minute after its last act.

        Args:
            events: all of it, see joint_belief.told_events.

        Returns:
            The belief that the observer had; None: there is nothing to go on with.
        """
        self._prepare()
        first = events[0] if events else None
        goals = self._goals
        if first is None or first.attempt is None or goals is None:
            return None
        # Of a demonstration that is too long for the log's reader the first events are missing.
        if first.objects != goals.objects or first.attempt.stamp != first.demonstration:
            return None
        self.person = self._person(first)
        start = zip(first.objects, first.start, strict=True)
        self._remember(first.attempt.start - 1, {n: x for n, x in start if x is not None})
        self._begin(first.attempt)
        for event in events:
            if event.attempt is not None:
                self._event(event.attempt)
        if events[-1].stopped:
            self._stop(events[-1].stamp, first.attempt.frame)
        self._last, self._taken_up = events[-1].stamp, True
        return self.belief

    def _person(self, first: ToldEvent) -> FloatArray | None:
        assert self._goals is not None, 'People have goals.'
        known = None if first.person is None else np.asarray(first.person)
        same = known is not None and known.shape == self._goals.people_prior.shape
        return known if same else None

    def _prepare(self) -> None:
        """Between two demonstrations: the hypothesis space, then its test, a little at a time."""
        if self.watcher is not None:
            return
        wanted = self.model, self.settings.largest
        if self._made is None or self._made[0] is not wanted[0] or self._made[1] != wanted[1]:
            self._made = wanted
            self.refusal = _refusal(self._world, *wanted)
            self._goals = None if self.refusal else JointGoals.of(self._world, self.model)
            self._rng, self._statistics = np.random.default_rng(SEED), []
            self._test: GoalTest | None = None
        elif self._goals is not None and self._test is None:
            self._statistics.append(simulated_statistic(self._goals, self._rng))
            if len(self._statistics) == SIMULATED:
                self._test = GoalTest.from_statistics(self._statistics, LEVEL)

    def _take(self, seen: ObservedAttempt) -> list[JointBelief]:
        assert self._goals is not None, 'Only what there are goals for is taken in.'
        if seen.object not in self._goals.objects:
            return []
        found: list[JointBelief] = []
        quiet = seen.start - self._acted >= self.settings.stop_delay * 1e9
        if self.watcher is not None and quiet and self._open is None:
            found.append(self._stop(seen.stamp, seen.frame))
        if self.watcher is None:
            self._begin(seen)
        if self._open not in (None, seen.object):
            if not seen.under_way:
                self._ended_meanwhile.append(seen)
            return found
        found.append(self._event(seen))
        if not seen.under_way:
            meanwhile, self._ended_meanwhile = self._ended_meanwhile, []
            found += [self._event(other) for other in meanwhile]
        return found

    def _begin(self, first: ObservedAttempt) -> None:
        assert self._goals is not None, 'Demonstrations are watched for goals.'
        count = len(self._world.states)
        at = next((s for t, s in reversed(self._tables) if t < first.start), {})
        unknown = np.full(count, 1 / count)
        start = {n: int(at[n]) if n in at else unknown for n in self._goals.objects}
        start[first.object] = self._state(first.x_i, first.x_i_probability)
        self._start = {**at, first.object: first.x_i}
        self.watcher, self._seen = self._goals.watch(start, self.person), []

    def _event(self, seen: ObservedAttempt) -> JointBelief:
        assert self.watcher is not None, 'An event belongs to a demonstration.'
        manner, direction = self._told(seen)
        x_f = None if seen.x_f is None else self._state(seen.x_f, seen.x_f_probability)
        self.watcher.see(
            Attempt(
                seen.object, self._state(seen.x_i, seen.x_i_probability), x_f, manner, direction,
                under_way=seen.under_way,
            )
        )  # fmt: skip
        self._open = seen.object if seen.under_way else None
        self._acted = max(self._acted, seen.stamp)
        self._seen.append(seen)
        if not seen.under_way:
            known = {n: x for n, x in self._known.items() if n != seen.object}
            self._remember(
                seen.stamp, known if seen.x_f is None else known | {seen.object: seen.x_f}
            )
        return self._believed(seen.stamp, seen.frame, seen)

    def _stop(self, stamp: int, frame: str) -> JointBelief:
        """End the demonstration; what it told of the person is kept."""
        assert self.watcher is not None, 'Only a demonstration ends.'
        self.watcher.see(Stopped())
        belief = self._believed(stamp, frame, None)
        self.person, self.watcher = self.watcher.person, None
        self._open, self._ended_meanwhile = None, []
        return belief

    def _believed(self, stamp: int, frame: str, event: ObservedAttempt | None) -> JointBelief:
        """The belief after an event; None: after the stop."""
        watcher, goals, stopped = self.watcher, self._goals, event is None
        assert watcher is not None, 'Beliefs are of a demonstration.'
        assert goals is not None, 'Beliefs are of goals.'
        changes = sorted(watcher.changes().items(), key=lambda item: -item[1])[:MOST_TOLD]
        described = tuple(goals.describe(change) for change, _ in changes)
        if stopped and self._test is not None:
            none = self._test.rejects(watcher)
        else:
            none = watcher.p_value <= LEVEL
        person = watcher.person if stopped else self.person if len(self._seen) == 1 else None
        self.belief = JointBelief(
            stamp=stamp,
            frame=frame,
            demonstration=self._seen[0].stamp,
            stopped=stopped,
            objects=goals.objects,
            start=tuple(self._start.get(name) for name in goals.objects),
            changes=tuple(changes),
            descriptions=described,
            marginals=np.stack([watcher.marginal(name) for name in goals.objects]),
            p_value=watcher.p_value,
            none_of_these=none,
            level=LEVEL,
            rationality=watcher.rationality,
            events=len(self._seen),
            unexplained=watcher.unexplained,
            sentence=told(
                self._seen,
                stopped,
                goals.objects,
                changes[0][0],
                described[0],
                changes[0][1],
                none,
            ),
            attempt=event,
            person=person,
        )
        return self.belief

    @property
    def _known(self) -> Mapping[str, State]:
        return self._tables[-1][1] if self._tables else {}

    def _remember(self, stamp: int, states: Mapping[str, State]) -> None:
        if states != self._known:
            self._tables.append((stamp, states))

    def _state(self, state: State, probability: tuple[float, ...]) -> int | FloatArray:
        """A state as the watcher takes it in: its number, or its distribution."""
        certain = not probability or max(probability) >= SURE_STATE
        if certain or not self.settings.soft_evidence:
            return int(state)
        return np.asarray(probability)

    def _told(self, seen: ObservedAttempt) -> tuple[Manner | None, int | None]:
        """Manner and direction as far as they are sure and some action has them."""
        manner = seen.manner if seen.manner_probability >= SURE_MANNER else None
        direction = seen.direction
        for m, d in ((manner, direction), (manner, None), (None, direction)):
            if any(m in (None, a.manner) and d in (None, a.target) for a in self._world.actions):
                return m, None if d is None else int(d)
        return None, None


def _refusal(world: World, model: RobotModel, largest: int) -> str:
    """Why no joint goals are inferred; empty if they are."""
    if largest == 0:
        return 'No joint goals are inferred: joint_goals is 0.'
    names = [name for name in world.objects if name in model.objects]
    if not names:
        return f'No joint goals are inferred: {model.label} has no trials of any object.'
    count = (len(world.states) + 1) ** len(names) - 1
    if count > largest:
        return (
            f'No joint goals are inferred: {len(names)} objects in {len(world.states)} regions '
            f'have {count}, joint_goals allows {largest}.'
        )
    return ''

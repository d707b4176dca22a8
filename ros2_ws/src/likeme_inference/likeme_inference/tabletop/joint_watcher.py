"""The posterior over joint goals and kinds of people after every event of a demonstration.

With the goal gamma and the kind of person theta (rationality, skill, change of mind) the filter
is

    w'(gamma, theta) = (1 - h(theta)) w(gamma, theta) + h(theta) P(gamma) sum over gamma of w
    w(gamma, theta) <- w'(gamma, theta) P(event | gamma, theta) / sum

with h(theta) the probability of a change of mind before an act. The likelihood of a finished
attempt is

    sum over x of b(x) sum over a of P(o, a | x, gamma, theta) sum over x_f of
        p_theta(x_f | x_o, a) e(x_f)

over the actions a that it may be, where b is the product of the objects' last seen states and e
the evidence on x_f. Of an act under way the choice alone counts. Perception's distributions enter
as they are, like the soft evidence of a single demonstration (evidence.py).
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from likeme_inference.tabletop.arrays import FloatArray, IntArray
from likeme_inference.tabletop.attempts import Attempt, Event, Stopped
from likeme_inference.tabletop.checks import table
from likeme_inference.tabletop.choice_tables import Where, possible
from likeme_inference.tabletop.evidence import evidence, known
from likeme_inference.tabletop.goal_space import GoalSpace, JointGoal

#: The least rationality of those who have a goal, in the test of "none of these".
PURPOSEFUL = 32.0
#: Probability below which a hypothesis is dropped; smaller numbers would be denormal, and slow.
LEAST = 1e-200
#: Of a person without a goal: probability to leave instead of acting.
LEAVES = 0.2


class Watcher:
    """Watches one demonstration; made by JointGoals.watch.

    Attributes:
        goals: the hypothesis space.
        weights: P(goal, person | events), shape [goal, person].
        unexplained: number of events that no hypothesis explains; they leave the posterior.
        log_evidence: of a person without a goal against one with one, ln of an e-value; see
            `p_value`. It does not depend on what was known of the person.
    """

    def __init__(
        self, goals: GoalSpace, start: Mapping[str, ArrayLike], person: ArrayLike | None
    ) -> None:
        """See JointGoals.watch.

        Raises:
            ValueError: an object without a start, an unknown state, or no distribution of people.
        """
        self.goals = goals
        self._states = len(goals.world.states)
        self._unknown: FloatArray = np.full(self._states, 1.0 / self._states)
        lacking = [name for name in goals.objects if name not in start]
        if lacking:
            raise ValueError(f'Expected the start of {lacking}, got that of {list(start)}.')
        self._where: list[Where] = [self._read('start', start[name]) for name in goals.objects]
        self.start: tuple[int, ...] = tuple(map(_likeliest, self._where))
        kinds = len(goals.people)
        people = goals.people_prior if person is None else np.asarray(person, np.float64)
        table('person', people, (kinds,))
        if not people.sum() > 0:
            raise ValueError('Expected probabilities of people, got none above 0.')
        people = people / people.sum()
        self.weights: FloatArray = np.outer(goals.prior, people)
        self.unexplained = 0
        self.log_evidence = self._most_evidence = 0.0
        # Undoes what is known of the person: the test begins anew.
        purposeful = (goals.people[:, 0] >= PURPOSEFUL) & (people > 0)
        anew = purposeful * goals.people_prior
        self._purposeful = np.divide(anew, people, out=np.zeros(kinds), where=purposeful)
        changing = goals.people[:, 2]
        self._keep, self._drawn = 1 - changing, np.outer(goals.prior, changing)
        self._under_way: str | None = None
        self._before = self.weights, self.log_evidence
        self._over = False
        # The required changes by number, and the number of each goal's, once they are asked for.
        self._change_of: tuple[dict[JointGoal, int], IntArray] | None = None

    def see(self, event: Event) -> FloatArray:
        """Take in an event; returns P(goal | events), shape [goal].

        An event that no hypothesis explains leaves the posterior, and is counted.

        Raises:
            ValueError: an unknown object, state or action; an event after the person stopped.
        """
        if self._over:
            raise ValueError('Expected events before the person stopped, got one after it.')
        if isinstance(event, Stopped):
            self._update(
                self._changed(), self.log_evidence, self.goals.choice.stop(self._where), None
            )
            self._over = True
        else:
            self._attempt(event)
        return self.posterior

    @property
    def posterior(self) -> FloatArray:
        """P(goal | events), shape [goal]."""
        return np.asarray(self.weights.sum(axis=1))

    @property
    def person(self) -> FloatArray:
        """P(kind of person | events), shape [person], for the person's next demonstration."""
        return np.asarray(self.weights.sum(axis=0))

    @property
    def rationality(self) -> float:
        """The expected rationality (geometric mean)."""
        return math.exp(float(self.person @ np.log(self.goals.people[:, 0])))

    @property
    def map_goal(self) -> JointGoal:
        """The most probable goal; ties go to the first."""
        return self.goals.goals[int(self.posterior.argmax())]

    def marginal(self, name: str) -> FloatArray:
        """P(goal of one object), shape [x + 1]; the last is "don't care"."""
        column = self.goals.numbers[:, self._object(name)]
        mass = np.bincount(column, self.posterior, minlength=self._states + 1)
        return np.asarray(mass, dtype=np.float64)

    def changes(self) -> dict[JointGoal, float]:
        """P(what must change from the start): goals that ask for the same changes are one."""
        if self._change_of is None:
            changes = [self.goals.change(goal, self.start) for goal in self.goals.goals]
            numbers = {change: k for k, change in enumerate(dict.fromkeys(changes))}
            self._change_of = numbers, np.array([numbers[change] for change in changes])
        numbers, which = self._change_of
        mass = np.bincount(which, self.posterior)
        return dict(zip(numbers, mass.tolist(), strict=True))

    @property
    def p_value(self) -> float:
        """Of the hypothesis that the person has one of the goals, valid at every moment.

        The ratio of the probabilities of all events, by a person who acts at random and by one of
        rationality PURPOSEFUL or more with one of the goals, is a martingale under the latter. By
        Ville's inequality it exceeds 1 / p with probability p at most, however long one watches. A
        uniform alternative among the goals would not do: people of little rationality explain
        random acts as well.
        """
        return math.exp(-max(self._most_evidence, 0.0))

    def _attempt(self, event: Attempt) -> None:
        o = self._object(event.object)
        actions = event.actions(self.goals.world)
        before = self._where[o] if event.x_i is None else self._read('x_i', event.x_i)
        after = None if event.x_f is None else self._read('x_f', event.x_f)
        if self._under_way == event.object:
            weights, log_evidence = self._before
        else:
            weights, log_evidence = self._changed(), self.log_evidence
        self._where[o] = before
        choice, moved = self.goals.choice, self.goals.outcome[o]
        states, likelihood, random = possible(before), np.zeros(1), np.zeros(1)
        scales = choice.scale(o, [x for x, _ in states], self._where)
        for (x, p), scale in zip(states, scales, strict=True):
            told = [p if after is None else p * _told(moved[a, x], after) for a in actions]
            acts = sum(choice.numerator(o, a, x) * t for a, t in zip(actions, told, strict=True))
            likelihood = likelihood + choice.by_goal(o, np.asarray(acts)) * scale
            random = random + sum(told)
        share = (1 - LEAVES) / (len(self.goals.objects) * len(self.goals.world.actions))
        self._update(weights, log_evidence, likelihood, random * share)
        self._under_way = event.object if event.under_way else None
        if event.under_way:
            self._before = weights, log_evidence
        else:
            self._where[o] = self._unknown if after is None else after

    def _update(
        self,
        weights: FloatArray,
        log_evidence: float,
        likelihood: FloatArray,
        random: FloatArray | float | None,
    ) -> None:
        """One step of the filter; `random`: of a person without a goal, None for a stop."""
        joint = weights * likelihood
        explained = joint.sum(axis=0)
        total = explained.sum()
        if not total > 0:
            self.weights = weights
            self.unexplained += 1
            return
        posterior = joint / total
        self.weights = posterior * (posterior > LEAST)
        people = weights.sum(axis=0) * self._purposeful
        given, seen = float(people.sum()), float(explained @ self._purposeful)
        if given > 0 and seen > 0:
            chance = LEAVES if random is None else float((people * random).sum()) / given
            self.log_evidence = log_evidence + math.log(chance * given / seen)
            self._most_evidence = max(self._most_evidence, self.log_evidence)

    def _changed(self) -> FloatArray:
        """The weights with a change of mind before the next act."""
        return np.asarray(self._keep * self.weights + self._drawn * self.person)

    def _read(self, what: str, seen: ArrayLike) -> Where:
        """A known state, or a distribution that sums to 1."""
        if isinstance(seen, int) and not isinstance(seen, bool) and 0 <= seen < self._states:
            return int(seen)
        read = evidence(what, seen, self._states)
        if read.ndim != (0 if known(read) else 1):
            raise ValueError(f'Expected {what} of one object, got shape {read.shape}.')
        if known(read):
            return int(read)
        total = float(read.sum())
        if not total > 0:
            raise ValueError(f'Expected {what} with a possible state, got {read.tolist()}.')
        return np.asarray(read / total)

    def _object(self, name: str) -> int:
        if name not in self.goals.objects:
            raise ValueError(f'Expected one of {list(self.goals.objects)}, got {name!r}.')
        return self.goals.objects.index(name)


def _told(moved: FloatArray, after: Where) -> FloatArray:
    """Probability of the evidence on x_f, shape [person]; moved: shape [x_f, person]."""
    return np.asarray(moved[after] if isinstance(after, int) else after @ moved)


def _likeliest(where: Where) -> int:
    return where if isinstance(where, int) else int(where.argmax())

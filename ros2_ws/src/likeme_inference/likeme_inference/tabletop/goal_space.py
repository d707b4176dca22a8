"""Joint goals over all objects of a world, and the people who may have them.

A joint goal has a state or "don't care" for each object: (S + 1)^O - 1 of them, 63 for three
objects in three regions. A person of rationality beta and skill s, who sees the objects in x and
wants the goal gamma, acts or stops with

    P(o, a | x, gamma) = (1 - e) exp(beta A_o(x_o, gamma_o, a)) / Z(x, gamma)
    P(stop | x, gamma) = e + (1 - e) exp(beta sum over o of L_o(x_o, gamma_o)) / Z(x, gamma)

with the advantages A (of acting) and L (of leaving as it is) of person_values.py, the sum Z of all
numerators, and the probability e of giving up or being interrupted. The object then moves by the
person's own p_s(x_f | x_o, a). This is Fig 3 of the paper, with one goal for all objects, several
acts, and P(A | G, X_i) of a noisily rational person instead of that of Fig 3c.

JointGoals (joint_goals.py) is this space with a watcher, which infers goal, rationality and skill
together.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike

from likeme_core.world import World
from likeme_inference.tabletop.arrays import FloatArray, IntArray
from likeme_inference.tabletop.checks import number, sums_to_one, table
from likeme_inference.tabletop.choice_tables import ChoiceTables, Where
from likeme_inference.tabletop.person_values import person_values, skilled

#: Values of beta, per object brought to its goal. In the paper's world at 32 one act in four is
#: needless, at 64 one in seventy.
RATIONALITY = (8.0, 16.0, 32.0, 64.0, 128.0)
#: Values of s.
SKILL = (0.0, 0.5, 0.9)
#: Values of h, and the shares of people who have them: few people often change their mind.
CHANGE_OF_MIND: Mapping[float, float] = MappingProxyType({0.003: 0.9, 0.2: 0.1})
#: Combinations of goals and kinds of people up to which a space is computed.
LARGEST = 200_000

JointGoal = tuple[int | None, ...]


class GoalSpace:
    """The hypothesis space: goals and kinds of people, with all tables computed once.

    Attributes:
        world: of the objects, states and actions.
        objects: their names; the order of a joint goal's entries.
        goals: shape [goal] of tuples [object]: number of a state, or None for "don't care".
        prior: P(goal), shape [goal].
        people: rationality, skill and change of mind of each kind, shape [person, 3].
        people_prior: P(kind), shape [person]: uniform over rationality and skill.
    """

    def __init__(
        self,
        world: World,
        transitions: Mapping[str, ArrayLike],
        *,
        goals: Sequence[JointGoal] | None = None,
        prior: ArrayLike | None = None,
        rationality: Sequence[float] = RATIONALITY,
        skill: Sequence[float] = SKILL,
        cost: float = 0.1,
        giving_up: float = 0.03,
        change_of_mind: Mapping[float, float] = CHANGE_OF_MIND,
    ) -> None:
        """Compute the tables.

        Args:
            world: of states and actions.
            transitions: p(X_f | X_i, A) of the robot, of each object, shape [x_i, a, x_f].
            goals: the candidates; None: all.
            prior: P(goal), shape [goal]; None: uniform.
            rationality: values of beta, above 0.
            skill: values of s, 0 to 1.
            cost: of an act, in units of one object brought to its goal.
            giving_up: e, the probability to stop at any time for no reason of the goal's.
            change_of_mind: values of h, the probability that the goal is drawn anew from the prior
                before an act, with the share of people who have each.

        Raises:
            ValueError: arguments that do not match or are not probabilities; too many hypotheses.
        """
        self.world, self.objects = world, tuple(transitions)
        states, actions = len(world.states), len(world.actions)
        own = [np.asarray(p, dtype=np.float64) for p in transitions.values()]
        for name, p in zip(self.objects, own, strict=True):
            table(f'transitions of {name}', p, (states, actions, states))
            sums_to_one(f'transitions of {name}', p)
        for what, values in (
            ('giving_up', (giving_up,)),
            ('skill', skill),
            ('change_of_mind', tuple(change_of_mind)),
            ('shares of people', tuple(change_of_mind.values())),
        ):
            _check_range(what, values)
        if not self.objects or not rationality or min(rationality) <= 0:
            raise ValueError(
                'Expected an object and a rationality above 0, got '
                f'{self.objects}, {tuple(rationality)}.'
            )
        self.goals = _joint_goals(goals, len(own), states)
        self.prior = _prior(prior, len(self.goals))
        self.people = np.array(list(product(rationality, skill, change_of_mind)))
        share = np.tile(list(change_of_mind.values()), len(rationality) * len(skill))
        self.people_prior: FloatArray = share / share.sum()
        size = len(self.goals) * len(self.people)
        if size > LARGEST:
            raise ValueError(
                f'Expected at most {LARGEST} combinations of goals and kinds of people, got '
                f'{size}; give candidate goals.'
            )
        #: Number of each goal's entry, "don't care" being the last, shape [goal, object].
        self.numbers: IntArray = np.array(
            [[states if g is None else g for g in goal] for goal in self.goals]
        )
        self._fill(own, float(cost), float(giving_up))

    def choices(self, where: Sequence[int], goal: int, person: int) -> FloatArray:
        """P(stop), then P(o, a) of each object's actions in turn, shape [1 + object * a].

        Args:
            where: state of each object.
            goal: position of the goal in `goals`.
            person: position of the kind in `people`.
        """
        at: list[Where] = list(where)
        chosen = [self.choice.stop(at)[goal, person]]
        for o, x in enumerate(where):
            scale, entry = self.choice.scale(o, [x], at)[0][goal, person], self.numbers[goal, o]
            chosen += [
                self.choice.numerator(o, a, x)[entry, person] * scale for a in self.world.actions
            ]
        return np.array(chosen)

    def change(self, goal: JointGoal, start: Sequence[int]) -> JointGoal:
        """What must change from the start: None where nothing must."""
        return tuple(None if g == x else g for g, x in zip(goal, start, strict=True))

    def describe(self, goal: JointGoal) -> str:
        """A goal in words: `lemon RIGHT, pear LEFT`; `nothing` if all is "don't care"."""
        states = self.world.states
        named = zip(self.objects, goal, strict=True)
        return ', '.join(f'{o} {states[g]}' for o, g in named if g is not None) or 'nothing'

    def _fill(self, own: list[FloatArray], cost: float, giving_up: float) -> None:
        stuck = np.array([x in self.world.out_of_reach for x in self.world.states])
        targets = tuple(int(a.target) for a in self.world.actions)
        rationality, skill, _ = self.people.T
        #: [object][a, x_i, x_f, person]: p_s(x_f | x_i, a).
        self.outcome: list[FloatArray] = []
        values = []
        for transition in own:
            moves = {s: skilled(transition, targets, stuck, s) for s in dict.fromkeys(skill)}
            valued = {s: person_values(p, cost) for s, p in moves.items()}
            values.append([valued[s] for s in skill])
            self.outcome.append(np.stack([moves[s].swapaxes(0, 1) for s in skill], axis=-1))
        self.choice = ChoiceTables(values, rationality, self.numbers, giving_up)


def every_joint_goal(objects: int, states: int) -> tuple[JointGoal, ...]:
    """All joint goals, except that no object matters."""
    every = product([*range(states), None], repeat=objects)
    return tuple(goal for goal in every if any(g is not None for g in goal))


def _joint_goals(
    given: Sequence[JointGoal] | None, objects: int, states: int
) -> tuple[JointGoal, ...]:
    if given is None:
        return every_joint_goal(objects, states)
    goals = tuple(tuple(goal) for goal in given)
    for goal in goals:
        if len(goal) != objects:
            raise ValueError(f'Expected goals of {objects} entries, got {goal}.')
        for g in goal:
            if g is not None:
                number('goal', g, states)
    if not goals or len(set(goals)) != len(goals):
        raise ValueError(f'Expected at least one goal, each once, got {goals}.')
    return goals


def _prior(given: ArrayLike | None, goals: int) -> FloatArray:
    if given is None:
        return np.full(goals, 1.0 / goals)
    prior = np.array(given, dtype=np.float64)
    table('prior', prior, (goals,))
    sums_to_one('prior', prior)
    return prior


def _check_range(what: str, values: Sequence[float]) -> None:
    if not values or not all(0 <= value <= 1 for value in values):
        raise ValueError(f'Expected {what} from 0 to 1, got {tuple(values)}.')

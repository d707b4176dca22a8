"""Simulated people who show joint goals: noisily rational, clumsy, habitual, skilled, or aimless.

Anybody can generate the same people: `demonstrations` depends on its arguments alone.
A demonstration is made as follows.

1. Each object starts in a state within reach, drawn uniformly. The joint goal is drawn uniformly
   from all joint goals, or from five candidates, until it asks for at least one change.
2. With probability GIVING_UP the person stops. Otherwise the person acts or stops with probability
   proportional to exp(rationality * advantage + habit), with the advantages of person_values.py
   for the person's own transitions and an act's cost of COST. The habit is a bonus for acts of the
   person's favourite manner.
3. The object moves by the person's transitions; a clumsy person's act leaves it where it is with
   an additional probability that the person does not reckon with.
4. This repeats from 2, for LONGEST acts at most. A demonstration without an act is drawn anew.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from likeme_core.tabletop import Manner
from likeme_core.world import World
from likeme_inference.tabletop.arrays import FloatArray, drawn
from likeme_inference.tabletop.attempts import Attempt
from likeme_inference.tabletop.goal_space import JointGoal, every_joint_goal
from likeme_inference.tabletop.person_values import PersonValues, person_values, skilled

#: Probability of stopping for no reason, cost of an act, greatest number of acts.
GIVING_UP, COST, LONGEST = 0.02, 0.1, 15
#: Of the sensible person, and of the noisy one, who makes many needless acts.
SENSIBLE, NOISY = 64.0, 32.0
#: Number of candidate goals of the noisy person.
CANDIDATES = 5
#: Probability that an act of an aimless person is the last.
LEAVES = 0.2


class Kind(StrEnum):
    """Kinds of people."""

    #: Rationality SENSIBLE, "like me" (the robot's own transitions).
    SENSIBLE = 'sensible'
    #: The same, of whose demonstrations only those are taken in which an act misses its target.
    FAILING = 'failing'
    #: Rationality NOISY; the goal is one of five that the observer knows.
    CANDIDATES = 'candidates'
    #: Sensible; every fourth act leaves the object where it is, besides the robot's own failures.
    CLUMSY = 'clumsy'
    #: Sensible, with a bonus of 2 nats for acts of a favourite manner, drawn for each person.
    HABITUAL = 'habitual'
    #: Rationality drawn for each person, log-uniform from 20 to 100.
    OFF_GRID = 'off-grid'
    #: Sensible; transitions are 0.8 of actions that never fail and 0.2 of the robot's own.
    SKILLED = 'skilled'
    #: Sensible; the goal is drawn anew once, before an act that is drawn from the first four.
    CHANGING = 'changing'
    #: No goal: uniform over all acts.
    AIMLESS = 'aimless'


@dataclass(frozen=True, eq=False)
class Person:
    """What a person is like.

    Attributes:
        rationality: beta.
        skill: of `person_values.skilled`.
        clumsiness: probability that an act does nothing, which the person does not reckon with.
        favourite: manner with a bonus.
        habit: the bonus, nats.
        candidates: goals that the person may have; empty: all.
    """

    rationality: float = SENSIBLE
    skill: float = 0.0
    clumsiness: float = 0.0
    favourite: Manner | None = None
    habit: float = 2.0
    candidates: tuple[JointGoal, ...] = ()


@dataclass(frozen=True, eq=False)
class Shown:
    """One demonstration.

    Attributes:
        person: number of the person.
        start: state of each object.
        goal: what was meant at the end; None: nothing.
        acts: all finished; the person stops after the last one.
    """

    person: int
    start: tuple[int, ...]
    goal: JointGoal | None
    acts: tuple[Attempt, ...]


@dataclass
class Demonstrator:
    """A person who acts in a world.

    Attributes:
        world: of states and actions.
        transitions: the robot's, by object, shape [x_i, a, x_f].
        person: what the person is like.
    """

    world: World
    transitions: Mapping[str, FloatArray]
    person: Person
    _values: list[PersonValues] = field(init=False)
    _moves: list[FloatArray] = field(init=False)

    def __post_init__(self) -> None:
        stuck = np.array([x in self.world.out_of_reach for x in self.world.states])
        targets = tuple(int(a.target) for a in self.world.actions)
        self._moves = [
            skilled(p, targets, stuck, self.person.skill) for p in self.transitions.values()
        ]
        self._values = [person_values(p, COST) for p in self._moves]
        favourite = [a.manner == self.person.favourite for a in self.world.actions]
        self._bonus = self.person.habit * np.array(favourite, dtype=np.float64)

    def next_act(
        self, where: Sequence[int], goal: JointGoal, rng: np.random.Generator
    ) -> tuple[int, int] | None:
        """Object and action; None: the person stops."""
        if rng.random() < GIVING_UP:
            return None
        numbers = [len(self.world.states) if g is None else g for g in goal]
        beta, each = self.person.rationality, list(zip(where, numbers, strict=True))
        acts = [beta * v.act[:, x, g] + self._bonus
                for v, (x, g) in zip(self._values, each, strict=True)]  # fmt: skip
        stop = beta * sum(v.leave[x, g] for v, (x, g) in zip(self._values, each, strict=True))
        choice = drawn(np.exp([*np.concatenate(acts), stop]), rng)
        actions = len(self.world.actions)
        return None if choice == len(where) * actions else divmod(choice, actions)

    def moved(self, o: int, a: int, x_i: int, rng: np.random.Generator) -> int:
        """Where the object ends."""
        if rng.random() < self.person.clumsiness:
            return x_i
        return drawn(self._moves[o][x_i, a], rng)


def demonstrations(
    kind: Kind,
    world: World,
    transitions: Mapping[str, FloatArray],
    people: int,
    each: int,
    seed: int,
) -> list[tuple[Person, list[Shown]]]:
    """People of a kind, with the demonstrations of each in order.

    Args:
        kind: of all of them.
        world: of states and actions.
        transitions: the robot's p(X_f | X_i, A) by object, shape [x_i, a, x_f].
        people: number of people.
        each: number of demonstrations of each.
        seed: of np.random.default_rng([seed, number of the kind, number of the person]).
    """
    found = []
    for number in range(people):
        rng = np.random.default_rng([seed, list(Kind).index(kind), number])
        person = _person(kind, world, len(transitions), rng)
        actor = Demonstrator(world, transitions, person)
        shown: list[Shown] = []
        while len(shown) < each:
            made = _demonstration(kind, actor, number, rng)
            if made.acts and (kind is not Kind.FAILING or failed(made, world)):
                shown.append(made)
        found.append((person, shown))
    return found


def failed(shown: Shown, world: World) -> bool:
    """Whether an act of the demonstration missed the target of its action."""
    return any(act.x_f != world.action(_action(act)).target for act in shown.acts)


def _person(kind: Kind, world: World, objects: int, rng: np.random.Generator) -> Person:
    if kind is Kind.CANDIDATES:
        every = every_joint_goal(objects, len(world.states))
        chosen = rng.choice(len(every), min(CANDIDATES, len(every)), replace=False)
        return Person(NOISY, candidates=tuple(every[k] for k in chosen))
    if kind is Kind.CLUMSY:
        return Person(clumsiness=0.25)
    if kind is Kind.HABITUAL:
        return Person(favourite=world.manners[rng.integers(len(world.manners))])
    if kind is Kind.OFF_GRID:
        return Person(float(np.exp(rng.uniform(np.log(20), np.log(100)))))
    return Person(skill=0.8) if kind is Kind.SKILLED else Person()


def _demonstration(
    kind: Kind, actor: Demonstrator, number: int, rng: np.random.Generator
) -> Shown:
    world, names = actor.world, list(actor.transitions)
    goals = actor.person.candidates or every_joint_goal(len(names), len(world.states))
    start, goal = _task(world, goals, len(names), rng)
    change = int(rng.integers(4)) if kind is Kind.CHANGING else -1
    where = list(start)
    acts: list[Attempt] = []
    while len(acts) < LONGEST:
        if len(acts) == change:
            goal, change = _wanted(goals, where, rng), -1
        if kind is Kind.AIMLESS:
            leaves = bool(acts) and rng.random() < LEAVES
            choice = (int(rng.integers(len(names))), int(rng.integers(len(world.actions))))
        else:
            decided = actor.next_act(where, goal, rng)
            leaves, choice = decided is None, decided or (0, 0)
        if leaves:
            break
        o, a = choice
        x_f = actor.moved(o, a, where[o], rng)
        acts.append(Attempt(names[o], where[o], x_f, action=a))
        where[o] = x_f
    return Shown(number, start, None if kind is Kind.AIMLESS else goal, tuple(acts))


def _task(
    world: World, goals: Sequence[JointGoal], objects: int, rng: np.random.Generator
) -> tuple[tuple[int, ...], JointGoal]:
    """Start and goal, of which at least one object must change."""
    reachable = [int(x) for x in world.states if x not in world.out_of_reach]
    while True:
        start = tuple(reachable[k] for k in rng.integers(len(reachable), size=objects))
        goal = goals[int(rng.integers(len(goals)))]
        if _asks(goal, start):
            return start, goal


def _wanted(goals: Sequence[JointGoal], where: list[int], rng: np.random.Generator) -> JointGoal:
    """Another goal that asks for a change; any, if none does."""
    open_ = [goal for goal in goals if _asks(goal, where)] or goals
    return open_[int(rng.integers(len(open_)))]


def _asks(goal: JointGoal, where: Sequence[int]) -> bool:
    return any(g is not None and g != x for g, x in zip(goal, where, strict=True))


def _action(act: Attempt) -> int:
    assert act.action is not None, 'Acts of simulated people name their action.'
    return act.action

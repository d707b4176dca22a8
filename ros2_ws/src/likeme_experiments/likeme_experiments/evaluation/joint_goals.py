"""Joint goals inferred from simulated people: how often right, and how well calibrated.

An inferred goal is right if it asks for the changes from the start that the person's goal asks for
(26 classes with three objects in three regions of which one cannot be left). Compared are the
watcher, which carries each person's rationality and skill from one demonstration to the next; the
same inference by an observer who is told them; and inference act by act, in which the last change
of each object alone gives its goal (Fig 3d of the paper).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from likeme_core.world import World
from likeme_experiments.evaluation.people import (
    GIVING_UP,
    Kind,
    Person,
    Shown,
    demonstrations,
)
from likeme_inference.tabletop.arrays import FloatArray
from likeme_inference.tabletop.attempts import Event, Stopped
from likeme_inference.tabletop.goal_model import GoalModel
from likeme_inference.tabletop.goal_space import JointGoal
from likeme_inference.tabletop.goal_test import GoalTest
from likeme_inference.tabletop.joint_goals import JointGoals
from likeme_inference.tabletop.joint_watcher import Watcher

#: Share of the acts after which inference is scored during a demonstration, rounded up.
PART = 0.75
#: Change of mind that the told observer of changing people reckons with.
CHANGE_OF_MIND = 0.25


class Moment(NamedTuple):
    """What was inferred after one event of a demonstration.

    Attributes:
        demonstration: 1 for the person's first.
        acts: finished acts so far.
        of: acts of the whole demonstration.
        stopped: whether the person has stopped, after the last act.
        probability: of the most probable changes, by the watcher.
        right, told, act_by_act: whether the watcher, the observer who is told the person's
            rationality and skill, and inference act by act are right.
        none: whether "none of these" was found, which is tested after the stop.
    """

    demonstration: int
    acts: int
    of: int
    stopped: bool
    probability: float
    right: bool
    told: bool
    act_by_act: bool
    none: bool

    @property
    def at_part(self) -> bool:
        """Whether it is the moment during the demonstration at which inference is scored."""
        return not self.stopped and self.acts == math.ceil(PART * self.of)


class Accuracy(NamedTuple):
    """Shares of right goals over some moments.

    Attributes:
        n: number of moments.
        watcher, told, act_by_act: see Moment.
    """

    n: int
    watcher: float
    told: float
    act_by_act: float


def accuracy_of(moments: Sequence[Moment]) -> Accuracy:
    """The shares of right goals."""
    rows = [(m.right, m.told, m.act_by_act) for m in moments]
    return Accuracy(len(rows), *np.mean(rows, axis=0).tolist())


def watched(
    kind: Kind,
    world: World,
    transitions: Mapping[str, FloatArray],
    people: int,
    each: int,
    seed: int,
    test: GoalTest | None = None,
) -> list[Moment]:
    """All moments of all demonstrations; arguments as of people.demonstrations.

    test: of "none of these"; None: not tested.
    """
    every = JointGoals(world, transitions)
    single = {name: GoalModel.of(p) for name, p in transitions.items()}
    found = []
    for person, shown in demonstrations(kind, world, transitions, people, each, seed):
        candidates = person.candidates or None
        own = JointGoals(world, transitions, goals=candidates) if candidates else every
        told = told_goals(world, transitions, kind, person)
        carried: FloatArray | None = None
        for number, demonstration in enumerate(shown, start=1):
            start = dict(zip(transitions, demonstration.start, strict=True))
            watcher = own.watch(start, carried)
            found += _moments(number, demonstration, watcher, told.watch(start), single, test)
            carried = watcher.person
    return found


def told_goals(
    world: World, transitions: Mapping[str, FloatArray], kind: Kind, person: Person
) -> JointGoals:
    """The hypothesis space of an observer who is told the person's rationality and skill."""
    return JointGoals(
        world,
        transitions,
        goals=person.candidates or None,
        rationality=(person.rationality,),
        skill=(person.skill,),
        giving_up=GIVING_UP,
        change_of_mind={CHANGE_OF_MIND if kind is Kind.CHANGING else 0.0: 1.0},
    )


def act_by_act(models: Mapping[str, GoalModel], shown: Shown, acts: int) -> JointGoal:
    """Changes by the paper's posterior of each object's last change; None if it was not moved."""
    names = list(models)
    changes: list[int | None] = [None] * len(names)
    for act in shown.acts[:acts]:
        o = names.index(act.object)
        goal = int(models[act.object].goal_posterior(act.x_i, act.x_f).argmax())  # type: ignore[arg-type]
        changes[o] = None if goal == shown.start[o] else goal
    return tuple(changes)


def most_probable(watcher: Watcher) -> tuple[JointGoal, float]:
    """The changes that were most probably meant, and their probability."""
    changes = watcher.changes()
    best = max(changes, key=changes.__getitem__)
    return best, changes[best]


def _moments(
    number: int,
    shown: Shown,
    watcher: Watcher,
    told: Watcher,
    single: Mapping[str, GoalModel],
    test: GoalTest | None,
) -> list[Moment]:
    truth = None if shown.goal is None else watcher.goals.change(shown.goal, shown.start)
    events: list[Event] = [*shown.acts, Stopped()]
    found, count = [], len(shown.acts)
    for k, event in enumerate(events, start=1):
        watcher.see(event)
        told.see(event)
        (best, probability), (theirs, _) = most_probable(watcher), most_probable(told)
        stopped, acts = k > count, min(k, count)
        none = test is not None and stopped and test.rejects(watcher)
        found.append(
            Moment(
                number, acts, count, stopped, probability, best == truth, theirs == truth,
                act_by_act(single, shown, acts) == truth, none,
            )
        )  # fmt: skip
    return found

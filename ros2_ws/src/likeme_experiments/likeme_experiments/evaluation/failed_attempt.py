"""Meltzoff's failed-attempt experiment (1995) with the robot as the observer.

Infants of 18 months produced an act as often when an adult had only tried it and failed as when it
had succeeded, and more often than after other manipulation of the object. Here, for each object,
each change from a state within reach and each manner of acting, a person

    target      acts towards the state once, and the object gets there;
    attempt     acts towards the state TRIES times, and the object stays where it was;
    control     handles the object as often, with acts towards the state where it is.

The other objects are together in each state within reach in turn. Of three agents, the first
infers what was meant (JointGoals) and does its own best action, the second copies the last act,
the third copies the outcome: its goal is that of the last change of state (the paper's Fig 3d).
An agent's success is the probability, by the robot's own model, that its action brings the object
to the state; all is computed without drawing.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from enum import StrEnum
from itertools import product
from typing import NamedTuple

import numpy as np

from likeme_core.tabletop import Action, State
from likeme_core.world import World
from likeme_experiments.evaluation.joint_goals import most_probable
from likeme_inference.tabletop.arrays import FloatArray
from likeme_inference.tabletop.attempts import Attempt, Event, Stopped
from likeme_inference.tabletop.goal_inference import map_goal
from likeme_inference.tabletop.goal_model import GoalModel
from likeme_inference.tabletop.joint_goals import JointGoals

#: Attempts of a demonstration, as in the experiment.
TRIES = 3


class Group(StrEnum):
    """What the person shows."""

    TARGET = 'target'
    ATTEMPT = 'attempt'
    CONTROL = 'control'


class Agent(StrEnum):
    """How the observer imitates."""

    INFERS = 'infers the goal'
    COPIES_ACT = 'copies the act'
    COPIES_OUTCOME = 'copies the outcome'


class FailedAttempt(NamedTuple):
    """Means over all cases.

    Attributes:
        cases: number of demonstrations of each group.
        success: P(the object is brought to the state), by group and agent.
        belief: P(the state is the object's goal) before and after each act, and after the stop, by
            group, shape [acts + 2].
    """

    cases: int
    success: Mapping[Group, Mapping[Agent, float]]
    belief: Mapping[Group, FloatArray]


class _Case(NamedTuple):
    object: str
    start: dict[str, State]
    target: State
    action: Action
    stays: Action


def failed_attempt(
    world: World, transitions: Mapping[str, FloatArray], tries: int = TRIES
) -> FailedAttempt:
    """Compute the experiment.

    Args:
        world: of states and actions.
        transitions: the robot's p(X_f | X_i, A) by object, shape [x_i, a, x_f].
        tries: acts of a demonstration of the groups ATTEMPT and CONTROL.
    """
    goals = JointGoals(world, transitions)
    models = {name: GoalModel.of(p) for name, p in transitions.items()}
    success: dict[Group, dict[Agent, float]] = {}
    belief: dict[Group, FloatArray] = {}
    cases = list(_cases(world, list(transitions)))
    for group in Group:
        courses, reached = [], []
        for case in cases:
            events = _events(group, case, tries)
            course, made = _observed(goals, models[case.object], case, events)
            courses.append(course)
            reached.append([made[agent] for agent in Agent])
        belief[group] = np.mean(courses, axis=0)
        success[group] = dict(zip(Agent, np.mean(reached, axis=0).tolist(), strict=True))
    return FailedAttempt(len(cases), success, belief)


def _cases(world: World, objects: list[str]) -> Iterator[_Case]:
    within = [x for x in world.states if x not in world.out_of_reach]
    for name, x_i, others, action in product(objects, within, within, world.actions):
        stays = world.action_of(action.manner, x_i)
        if action.target != x_i and stays is not None:
            start = {each: x_i if each == name else others for each in objects}
            yield _Case(name, start, action.target, action, stays)


def _events(group: Group, case: _Case, tries: int) -> list[Event]:
    x_i = case.start[case.object]
    if group is Group.TARGET:
        return [Attempt(case.object, x_i, case.target, action=case.action), Stopped()]
    action = case.action if group is Group.ATTEMPT else case.stays
    return [*[Attempt(case.object, x_i, x_i, action=action)] * tries, Stopped()]


def _observed(
    goals: JointGoals, model: GoalModel, case: _Case, events: list[Event]
) -> tuple[list[float], dict[Agent, float]]:
    """The course of P(the state is the goal), and each agent's success; the object is put back."""
    watcher, x_i, o = goals.watch(case.start), case.start[case.object], case.target
    course = [float(watcher.marginal(case.object)[o])]
    for event in events:
        watcher.see(event)
        course.append(float(watcher.marginal(case.object)[o]))
    last = next(event for event in reversed(events) if isinstance(event, Attempt))
    assert last.action is not None
    assert isinstance(last.x_f, int)
    meant = most_probable(watcher)[0][goals.objects.index(case.object)]
    shown = map_goal(model.goal_posterior(x_i, last.x_f), last.x_f)
    return course, {
        Agent.INFERS: 0.0 if meant is None else _best(model, x_i, meant, case.target),
        Agent.COPIES_ACT: float(model.transition[x_i, last.action, case.target]),
        Agent.COPIES_OUTCOME: 0.0 if shown == x_i else _best(model, x_i, shown, case.target),
    }


def _best(model: GoalModel, x_i: int, goal: int, target: int) -> float:
    """P(target) of the most probable action for a goal."""
    action = int(model.action_for(x_i, goal).argmax())
    return float(model.transition[x_i, action, target])

"""The robot's turn after a joint goal was shown: which object is next, and what is done for it."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from typing import NamedTuple

from likeme_core.observations import Demonstration, TableSnapshot
from likeme_core.tabletop import Manner, State
from likeme_inference.tabletop.action_selection import Kind
from likeme_inference.tabletop.goal_inference import map_index
from likeme_inference.tabletop.imitation import ImitationSettings, can_infer, decide
from likeme_inference.tabletop.robot_model import RobotModel
from likeme_inference.tabletop.values import Decision, ObjectGoal, TableGoal


class TableStep(NamedTuple):
    """What is done next, and the object's part of the joint goal as a demonstration of it."""

    decision: Decision
    demonstration: Demonstration


def next_of_table(
    model: RobotModel,
    settings: ImitationSettings,
    table: TableGoal,
    view: TableSnapshot,
    number: int,
    done: Collection[str],
) -> TableStep | None:
    """Decide on the next object that is not where it is wanted; None: there is none.

    What the robot can do comes first, in the order of the goals. Then it asks, once: the decision
    names the other objects that it would ask about.

    Args:
        model: the robot's trials.
        settings: of the decision.
        table: the joint goal.
        view: a settled table.
        number: of the decision.
        done: objects that had their turn.
    """
    steps = [
        TableStep(decide(model, settings, demo, view, number, given=goal.posterior), demo)
        for goal, demo in _off_goal(model, settings, table, view, done)
    ]
    if not steps:
        return None
    acts = [step for step in steps if step.decision.kind is Kind.EXECUTE]
    asks = [step for step in steps if step.decision.kind is Kind.ASK_HUMAN]
    if acts or len(asks) < 2:
        return (acts or asks or steps)[0]
    decision, demonstration = asks[0]
    also = tuple((step.decision.object, step.decision.goal) for step in asks[1:])
    return TableStep(replace(decision, also=also), demonstration)


def is_back(table: TableGoal, view: TableSnapshot | None) -> bool:
    """Whether all objects of a joint goal are where they were before it was shown."""
    states = {} if view is None else view.states
    return all(
        goal.x_i is not None and goal.x_i == states.get(goal.object) for goal in table.goals
    )


def posterior_of(table: TableGoal | None, demo: Demonstration | None) -> tuple[float, ...]:
    """P(G) of a demonstrated object by the joint goal; empty: it is none of its objects."""
    if table is None or demo is None:
        return ()
    return {goal.object: goal.posterior for goal in table.goals}.get(demo.object, ())


def _off_goal(
    model: RobotModel,
    settings: ImitationSettings,
    table: TableGoal,
    view: TableSnapshot,
    done: Collection[str],
) -> list[tuple[ObjectGoal, Demonstration]]:
    found = []
    for goal in table.goals:
        x: State | None = view.states.get(goal.object)
        wanted = settings.world.states[map_index(goal.posterior)]
        if x in (None, wanted) or goal.object in done:
            continue
        if x is not None and can_infer(model, settings, goal.object):
            shown, x_i = table.demonstration, x if goal.x_i is None else goal.x_i
            demo = Demonstration(
                shown, table.frame, goal.object, x_i, wanted, Manner.PLACE, shown, shown
            )
            found.append((goal, demo))
    return found

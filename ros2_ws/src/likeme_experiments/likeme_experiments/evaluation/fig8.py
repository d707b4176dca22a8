"""Fig 8: for each interesting demonstration goal, action, prediction, and asking or not."""

from __future__ import annotations

from typing import NamedTuple

from likeme_core.tabletop import Action, Mode, State
from likeme_core.world import World
from likeme_experiments.evaluation.demonstrations import interesting
from likeme_inference.tabletop.action_selection import Kind, choose
from likeme_inference.tabletop.goal_inference import map_goal
from likeme_inference.tabletop.robot_model import RobotModel


class Fig8Column(NamedTuple):
    """One column of one object's row, in all three parts of the figure.

    Attributes:
        goal_posterior: P(G | x_i, x_f), shape [g]; 8a.
        goal: its mode.
        action_posterior: P(A | x_i, G = goal), shape [a]; 8b.
        action: its mode; None where the object is at the goal as it was inferred.
        predicted: P(X_f | x_i, A = action), shape [x_f]; 8c; empty without an action.
        predicted_success: of reaching the goal, the height of 8c's bar; NaN without an action.
        asks: whether the interactive mode asks.
    """

    object: str
    x_i: State
    x_f: State
    goal_posterior: tuple[float, ...]
    goal: State
    action_posterior: tuple[float, ...]
    action: Action | None
    predicted: tuple[float, ...]
    predicted_success: float
    asks: bool


def fig8(model: RobotModel, world: World, threshold: float = 0.5) -> list[Fig8Column]:
    """Compute all three parts for every interesting demonstration."""
    return [_case(model, world, threshold, *shown) for shown in interesting(model, world)]


def _case(
    model: RobotModel, world: World, threshold: float, name: str, x_i: State, x_f: State
) -> Fig8Column:
    known = model.goal_model(name)
    posterior = known.goal_posterior(x_i, x_f)
    goal = world.states[map_goal(posterior, x_f)]
    made = choose(known, x_i, goal, None, Mode.INTERACTIVE, threshold)
    return Fig8Column(
        object=name,
        x_i=x_i,
        x_f=x_f,
        goal_posterior=tuple(posterior.tolist()),
        goal=goal,
        action_posterior=made.action_probability,
        action=None if made.action is None else world.actions[made.action],
        predicted=made.predicted,
        predicted_success=made.predicted_success,
        asks=made.kind is Kind.ASK_HUMAN,
    )

"""Predicted success of an imitation by each approach, with its posterior uncertainty.

The robot acts on the point estimate of p(X_f | X_i, A). The uncertainty of the success it predicts
is computed in worlds drawn from the Dirichlet posterior of the same trials; in each of them the
robot takes the same actions. An action is chosen as the best of several noisy rows, so that its
prediction is too high on average (winner's curse); the row's own posterior does not show that.
"""

from __future__ import annotations

from enum import StrEnum
from typing import NamedTuple

import numpy as np

from likeme_core.tabletop import Manner, Mode, State
from likeme_core.world import World
from likeme_inference.tabletop.action_selection import Kind, choose
from likeme_inference.tabletop.arrays import FloatArray
from likeme_inference.tabletop.dirichlet import CONCENTRATION, sample_transitions
from likeme_inference.tabletop.goal_inference import map_goal
from likeme_inference.tabletop.goal_model import GoalModel
from likeme_inference.tabletop.planning import spread
from likeme_inference.tabletop.prior import Prior
from likeme_inference.tabletop.robot_model import RobotModel
from likeme_inference.tabletop.transition_model import TransitionModel

#: Predicted success below which the interactive mode asks.
THRESHOLD = 0.5
#: Actions of the sequential mode.
BUDGET = 3
#: Worlds drawn from the posterior.
WORLDS = 4000


class Approach(StrEnum):
    """How a demonstration is imitated: the columns of Table 1, and several actions."""

    TRAJECTORY = 'trajectory'
    GOAL_BASED = 'goal_based'
    INTERACTIVE = 'interactive'
    SEQUENTIAL = 'sequential'
    SEQUENTIAL_WITH_HELP = 'sequential_with_help'

    @property
    def mode(self) -> Mode:
        """The robot's mode; the two sequential approaches differ in whether a human helps."""
        return Mode.SEQUENTIAL if self is Approach.SEQUENTIAL_WITH_HELP else Mode(self.value)

    @property
    def helped(self) -> bool:
        """Whether a human gives the help that the robot asks for."""
        return self in (Approach.INTERACTIVE, Approach.SEQUENTIAL_WITH_HELP)


class Estimate(NamedTuple):
    """Which estimate of p(X_f | X_i, A) the robot acts on.

    Attributes:
        concentration: pseudo-count of every final state; 0: maximum likelihood.
        prior: whether one fitted to the trials of all objects is used instead.
    """

    concentration: float = 0.0
    prior: Prior = Prior.OWN

    def counted(self, model: RobotModel, name: str) -> TransitionModel:
        """The trials of one object with this prior."""
        return model.counted(name, *self)

    def known(self, model: RobotModel, name: str) -> GoalModel:
        """The goal model the robot acts on."""
        return model.goal_model(name, concentration=self.concentration, prior=self.prior)

    def worlds(
        self, model: RobotModel, name: str, rng: np.random.Generator, samples: int
    ) -> FloatArray:
        """Worlds drawn from the posterior, shape [world, x_i, a, x_f].

        Maximum likelihood gets the default prior: without one, a single trial would be certain.
        """
        counted = self.counted(model, name)
        sure = not np.any(counted.prior)
        return sample_transitions(
            TransitionModel(counted.counts, CONCENTRATION) if sure else counted, rng, samples
        )


MAXIMUM_LIKELIHOOD = Estimate()


class DemonstrationCase(NamedTuple):
    """An object, its change of state and the manner of the demonstration."""

    object: str
    x_i: State
    x_f: State
    manner: Manner


class Forecast(NamedTuple):
    """Prediction for one case and approach.

    Attributes:
        success: of the demonstrated goal, by the point estimate.
        help_rate: probability of asking.
        worlds: success in worlds drawn from the posterior, shape [world].
    """

    success: float
    help_rate: float
    worlds: FloatArray


def forecasts(
    world: World,
    model: RobotModel,
    cases: list[DemonstrationCase],
    rng: np.random.Generator,
    estimate: Estimate = MAXIMUM_LIKELIHOOD,
    worlds: int = WORLDS,
) -> dict[tuple[DemonstrationCase, Approach], Forecast]:
    """Every case by every approach.

    Args:
        world: of states and actions.
        model: of the robot.
        cases: of objects in the model.
        rng: draws the worlds.
        estimate: the robot acts on it.
        worlds: number of them.
    """
    drawn = {name: estimate.worlds(model, name, rng, worlds) for name in model.objects}
    return {
        (case, approach): forecast(
            world, estimate.known(model, case.object), case, approach, drawn[case.object]
        )
        for case in cases
        for approach in Approach
    }  # fmt: skip


def forecast(
    world: World,
    known: GoalModel,
    case: DemonstrationCase,
    approach: Approach,
    worlds: FloatArray,
) -> Forecast:
    """One case by one approach.

    known: the model the robot acts on. worlds: shape [world, x_i, a, x_f].
    """
    _, x_i, x_f, manner = case
    goal = map_goal(known.goal_posterior(x_i, x_f), x_f)
    if approach.mode is Mode.SEQUENTIAL:
        return _several(known, x_i, x_f, goal, approach, worlds)
    demonstrated = world.action_of(manner, x_f)
    made = choose(known, x_i, goal, demonstrated, approach.mode, THRESHOLD)
    if made.kind is Kind.EXECUTE:
        assert made.action is not None, 'A decision to execute has an action.'
        return Forecast(made.predicted[x_f], 0.0, worlds[:, x_i, made.action, x_f])
    asks = float(made.kind is Kind.ASK_HUMAN)
    sure = asks * float(goal == x_f)
    return Forecast(sure, asks, np.full(len(worlds), sure))


def _several(
    known: GoalModel, x_i: State, x_f: State, goal: int, approach: Approach, worlds: FloatArray
) -> Forecast:
    """A plan of several actions: asks where none is left and the goal is not reached."""
    reached = known.goals[goal] > 0
    best = known.plan(goal, BUDGET)
    own, drawn = (
        spread(transition, best, x_i, BUDGET)[..., BUDGET, :]
        for transition in (known.transition, worlds)
    )
    asks = float(own[~reached].sum())
    if not approach.helped:
        return Forecast(float(own[x_f]), asks, drawn[:, x_f])
    # The human brings the object to the goal that the robot inferred.
    if goal == x_f:
        return Forecast(1.0, asks, np.ones(len(worlds)))
    return Forecast(0.0, asks, np.zeros(len(worlds)))

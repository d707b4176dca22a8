"""What a model expects of an imitation in each way, and how sure its few trials let it be of that.

The robot acts on the point estimate of p(X_f | X_i, A). How sure it may be of the success it
predicts is another question: that is computed in worlds drawn from the Dirichlet posterior of the
same trials, in each of which the robot does what it would do anyway. The row an action is chosen
from is one of several noisy ones, and the best of them looks better than it is (the winner's
curse); the posterior of that row alone does not know that.
"""

from __future__ import annotations

from enum import StrEnum
from typing import NamedTuple

import numpy as np

from likeme_core.tabletop import Action, Manner, Mode, State
from likeme_inference.tabletop.action_selection import Kind, choose
from likeme_inference.tabletop.arrays import FloatArray
from likeme_inference.tabletop.dirichlet import CONCENTRATION, sample_transitions
from likeme_inference.tabletop.goal_inference import map_goal
from likeme_inference.tabletop.goal_model import GoalModel
from likeme_inference.tabletop.planning import spread
from likeme_inference.tabletop.robot_model import RobotModel
from likeme_inference.tabletop.transition_model import TransitionModel

#: Below which the interactive mode asks.
THRESHOLD = 0.5
#: Actions of the sequential mode.
BUDGET = 3
#: Worlds drawn from the posterior.
WORLDS = 4000


class Way(StrEnum):
    """How a demonstration is imitated: Table 1's columns, and acting more than once."""

    TRAJECTORY = 'trajectory'
    GOAL_BASED = 'goal_based'
    INTERACTIVE = 'interactive'
    SEQUENTIAL = 'sequential'
    SEQUENTIAL_WITH_HELP = 'sequential_with_help'

    @property
    def mode(self) -> Mode:
        """The mode the robot is in; sequential asks, and with help somebody answers."""
        return Mode.SEQUENTIAL if self is Way.SEQUENTIAL_WITH_HELP else Mode(self.value)

    @property
    def helped(self) -> bool:
        """Whether a person does what the robot asks for."""
        return self in (Way.INTERACTIVE, Way.SEQUENTIAL_WITH_HELP)


class Estimate(NamedTuple):
    """Which estimate of p(X_f | X_i, A) the robot acts on.

    Attributes:
        concentration: pseudo-count of every final state; 0: maximum likelihood.
        shared: whether instead the trials of all objects choose the prior together.
    """

    concentration: float = 0.0
    shared: bool = False

    def counted(self, model: RobotModel, name: str) -> TransitionModel:
        """The trials of one object with this prior."""
        return model.counted(name, *self)

    def known(self, model: RobotModel, name: str) -> GoalModel:
        """What the robot acts on."""
        return model.goal_model(name, concentration=self.concentration, shared=self.shared)

    def worlds(
        self, model: RobotModel, name: str, rng: np.random.Generator, samples: int
    ) -> FloatArray:
        """Worlds drawn from the posterior, shape [world, x_i, a, x_f].

        Maximum likelihood alone would be certain after one trial: it gets the default prior.
        """
        counted = self.counted(model, name)
        sure = not np.any(counted.prior)
        return sample_transitions(
            TransitionModel(counted.counts, CONCENTRATION) if sure else counted, rng, samples
        )


MAXIMUM_LIKELIHOOD = Estimate()


class Case(NamedTuple):
    """What a person shows: one cell of the table before its changes are averaged."""

    object: str
    x_i: State
    x_f: State
    manner: Manner


class Forecast(NamedTuple):
    """What the model expects of one case in one way.

    Attributes:
        success: of the goal shown, by the point estimate.
        help_rate: how often it asks.
        worlds: success in worlds drawn from the posterior, shape [world].
    """

    success: float
    help_rate: float
    worlds: FloatArray


def forecasts(
    model: RobotModel,
    cases: list[Case],
    rng: np.random.Generator,
    estimate: Estimate = MAXIMUM_LIKELIHOOD,
    worlds: int = WORLDS,
) -> dict[tuple[Case, Way], Forecast]:
    """Every case in every way.

    Args:
        model: what the robot learned.
        cases: of objects the model knows.
        rng: draws the worlds.
        estimate: that the robot acts on.
        worlds: how many.
    """
    drawn = {name: estimate.worlds(model, name, rng, worlds) for name in model.objects}
    return {
        (case, way): forecast(
            estimate.known(model, case.object),
            case, way, drawn[case.object],
        )
        for case in cases
        for way in Way
    }  # fmt: skip


def forecast(known: GoalModel, case: Case, way: Way, worlds: FloatArray) -> Forecast:
    """One case in one way.

    known: what the robot acts on. worlds: shape [world, x_i, a, x_f].
    """
    _, x_i, x_f, manner = case
    goal = map_goal(known.goal_posterior(x_i, x_f), x_f)
    if way.mode is Mode.SEQUENTIAL:
        return _several(known, x_i, x_f, goal, way, worlds)
    demonstrated = Action.of(manner, x_f)
    made = choose(known, x_i, goal, demonstrated, way.mode, THRESHOLD)
    if made.kind is Kind.EXECUTE:
        assert made.action is not None, 'What is executed is an action.'
        return Forecast(made.predicted[x_f], 0.0, worlds[:, x_i, made.action, x_f])
    asks = float(made.kind is Kind.ASK_HUMAN)
    sure = asks * float(goal == x_f)
    return Forecast(sure, asks, np.full(len(worlds), sure))


def _several(
    known: GoalModel, x_i: State, x_f: State, goal: int, way: Way, worlds: FloatArray
) -> Forecast:
    """A plan of several actions: asks where it can do nothing more and is not at its goal."""
    reached = known.goals[goal] > 0
    best = known.plan(goal, BUDGET)
    own, drawn = (
        spread(transition, best, x_i, BUDGET)[..., BUDGET, :]
        for transition in (known.transition, worlds)
    )
    asks = float(own[~reached].sum())
    if not way.helped:
        return Forecast(float(own[x_f]), asks, drawn[:, x_f])
    # The person brings to the robot's goal whatever is not there.
    if goal == x_f:
        return Forecast(1.0, asks, np.ones(len(worlds)))
    return Forecast(0.0, asks, np.zeros(len(worlds)))

"""How goals, actions, predictions and asking depend on the prior of p(X_f | X_i, A).

The reference is the paper's setting: maximum likelihood, the prior of concentration 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from likeme_core.tabletop import Mode
from likeme_inference.tabletop.action_selection import Kind, choose
from likeme_inference.tabletop.arrays import BoolArray, FloatArray, IntArray
from likeme_inference.tabletop.domain import Policy
from likeme_inference.tabletop.goal_inference import map_goal, map_index
from likeme_inference.tabletop.prior import Prior
from likeme_inference.tabletop.robot_model import RobotModel

#: Action of a decision to do nothing, as the goal is believed to be where the object is.
NO_ACTION = -1


class PriorSetting(NamedTuple):
    """A prior of p(X_f | X_i, A).

    Attributes:
        prior: OWN, or one fitted to the trials of all objects.
        concentration: pseudo-count of every final state with Prior.OWN; 0: maximum likelihood.
    """

    prior: Prior = Prior.OWN
    concentration: float = 0.0

    @property
    def label(self) -> str:
        """Short name: `ML`, a concentration, or the prior's name."""
        if self.prior is not Prior.OWN:
            return str(self.prior)
        return f'{self.concentration:.3g}' if self.concentration > 0 else 'ML'


#: The paper's.
REFERENCE = PriorSetting()
#: The paper's, and from a hundredth of a pseudo-count to as many as there are trials of a row.
GRID = (
    REFERENCE,
    *(PriorSetting(Prior.OWN, c) for c in (0.01, 0.03, 0.09, 0.3, 0.5, 1.0, 2.0, 3.0, 5.0, 10.0)),
    PriorSetting(Prior.SHARED),
    PriorSetting(Prior.STRUCTURED),
)


class ShownChange(NamedTuple):
    """A demonstration: an object and the numbers of its states before and after."""

    object: str
    x_i: int
    x_f: int


class PriorSensitivity(NamedTuple):
    """What the robot does about each demonstration under each prior.

    Attributes:
        settings: the priors; the first is the reference.
        changes: the demonstrations.
        posterior: P(G | x_i, x_f), shape [setting, change, g].
        goal: its mode, a number of a goal, shape [setting, change].
        action: the best action from x_i for it, or NO_ACTION, same shape.
        success: predicted of that action; NaN without one; same shape.
        asks: whether the robot asks, same shape.
    """

    settings: tuple[PriorSetting, ...]
    changes: tuple[ShownChange, ...]
    posterior: FloatArray
    goal: IntArray
    action: IntArray
    success: FloatArray
    asks: BoolArray

    @property
    def differs(self) -> BoolArray:
        """Whether goal, action or asking are not those of the reference, [setting, change]."""
        each = (self.goal, self.action, self.asks)
        return np.asarray(np.any([v != v[:1] for v in each], axis=0))


def changes_shown(model: RobotModel) -> tuple[ShownChange, ...]:
    """Every change from a state within reach, object by object: the paper's 12 demonstrations."""
    domain = model.domain
    states = range(len(domain.states))
    return tuple(
        ShownChange(name, x_i, x_f)
        for name in model.objects
        for x_i in states
        if not domain.stuck[x_i]
        for x_f in states
        if x_f != x_i
    )


def prior_sensitivity(
    model: RobotModel,
    settings: Sequence[PriorSetting] = GRID,
    threshold: float = 0.5,
    *,
    mode: Mode = Mode.INTERACTIVE,
    goal_prior: Sequence[float] | None = None,
    policy: Policy = Policy.DIRECT,
    changes: Sequence[ShownChange] | None = None,
) -> PriorSensitivity:
    """Infer, choose and predict for each demonstration under each prior.

    Args:
        model: the robot's trials.
        settings: priors; the first is the reference.
        threshold: predicted success below which the robot asks.
        mode: INTERACTIVE is the paper's that asks.
        goal_prior: P(G), shape [g]; None: uniform.
        policy: which of the paper's two variants.
        changes: demonstrations; None: `changes_shown`.

    Raises:
        ValueError: no setting; a fitted prior of actions that aim at no state.
    """
    if not settings:
        raise ValueError('Expected at least one prior, got none.')
    shown = changes_shown(model) if changes is None else tuple(changes)
    shape, goals = (len(settings), len(shown)), len(model.domain.goals)
    # Of goals that are equally probable the one that was shown, where goals are the states.
    are_states = np.array_equal(model.domain.goal_matrix, np.eye(len(model.domain.states)))
    found = PriorSensitivity(
        tuple(settings),
        shown,
        np.zeros((*shape, goals)),
        np.zeros(shape, dtype=np.int64),
        np.full(shape, NO_ACTION),
        np.full(shape, np.nan),
        np.zeros(shape, dtype=bool),
    )
    for s, setting in enumerate(settings):
        for c, (name, x_i, x_f) in enumerate(shown):
            known = model.goal_model(
                name, goal_prior, policy, setting.concentration, setting.prior
            )
            posterior = known.goal_posterior(x_i, x_f)
            goal = map_goal(posterior, x_f) if are_states else map_index(posterior)
            made = choose(known, x_i, goal, None, mode, threshold)
            found.posterior[s, c], found.goal[s, c] = posterior, goal
            found.asks[s, c] = made.kind is Kind.ASK_HUMAN
            if made.action is not None:
                found.action[s, c], found.success[s, c] = made.action, made.predicted_success
    return found


class TurningPoint(NamedTuple):
    """The least concentration of a range at which the robot acts otherwise than the paper's.

    Attributes:
        change: the demonstration.
        concentration: NaN if goal, action and asking stay as they are over the whole range; `low`
            if they change there or below.
        what: what changes there: 'goal', 'action' or 'asks'; empty without a change.
    """

    change: ShownChange
    concentration: float
    what: str


def turning_points(
    model: RobotModel,
    threshold: float = 0.5,
    *,
    low: float = 0.001,
    high: float = 100.0,
    steps: int = 50,
) -> tuple[TurningPoint, ...]:
    """For each demonstration the least concentration that changes what the robot does.

    Maximum likelihood is the reference. The range is searched in `steps` steps of equal ratio and
    then by halving, to 0.1 %; a change that is taken back within one step may be missed.

    Args:
        model: the robot's trials.
        threshold: predicted success below which the robot asks.
        low: least concentration, above 0.
        high: greatest concentration.
        steps: number of steps.

    Raises:
        ValueError: bounds that are not in order.
    """
    if not 0 < low < high or steps < 1:
        raise ValueError(f'Expected 0 < low < high and a step, got {low:g}, {high:g}, {steps}.')
    tried = np.geomspace(low, high, steps + 1).tolist()
    settings = [REFERENCE, *(PriorSetting(Prior.OWN, c) for c in tried)]
    found = prior_sensitivity(model, settings, threshold)
    return tuple(
        _turning(model, change, threshold, tried, found.differs[1:, c])
        for c, change in enumerate(found.changes)
    )


def _turning(
    model: RobotModel,
    change: ShownChange,
    threshold: float,
    tried: Sequence[float],
    differs: BoolArray,
) -> TurningPoint:
    if not differs.any():
        return TurningPoint(change, np.nan, '')
    first = int(differs.argmax())

    def at(concentration: float) -> PriorSensitivity:
        settings = REFERENCE, PriorSetting(Prior.OWN, concentration)
        return prior_sensitivity(model, settings, threshold, changes=[change])

    below, above = tried[max(0, first - 1)], tried[first]
    while above > below * 1.001:
        middle = float(np.sqrt(below * above))
        below, above = (below, middle) if at(middle).differs[1, 0] else (middle, above)
    there = at(above)
    what = next(
        name
        for name in ('goal', 'action', 'asks')
        if getattr(there, name)[0, 0] != getattr(there, name)[1, 0]
    )
    return TurningPoint(change, above, what)

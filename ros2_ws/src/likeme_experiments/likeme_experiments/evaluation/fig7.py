"""Fig 7: the learned transition model, without the actions that leave a state as it is."""

from __future__ import annotations

from typing import NamedTuple

from likeme_core.tabletop import Action, State
from likeme_core.world import World
from likeme_inference.tabletop.dirichlet import credible_interval
from likeme_inference.tabletop.robot_model import RobotModel


class TransitionBars(NamedTuple):
    """One group of bars: an action from a state.

    Attributes:
        probability: p(X_f | x_i, a), shape [x_f].
        low, high: 95 % credible bounds of each, shape [x_f] (not in the paper).
        trials: number of trials.
    """

    object: str
    x_i: State
    action: Action
    probability: tuple[float, ...]
    low: tuple[float, ...]
    high: tuple[float, ...]
    trials: int


def fig7(model: RobotModel, world: World) -> list[TransitionBars]:
    """Collect the bars the paper shows: "We do not show actions that cause self-transitions"."""
    shown = []
    for name, learned in model.objects.items():
        bounds = credible_interval(learned)
        for x_i in (state for state in world.states if state not in world.out_of_reach):
            for a in (action for action in world.actions if action.target != x_i):
                shown.append(
                    TransitionBars(
                        name,
                        x_i,
                        a,
                        tuple(learned.transition[x_i, a].tolist()),
                        tuple(bounds.low[x_i, a].tolist()),
                        tuple(bounds.high[x_i, a].tolist()),
                        int(learned.counts[x_i, a].sum()),
                    )
                )
    return shown

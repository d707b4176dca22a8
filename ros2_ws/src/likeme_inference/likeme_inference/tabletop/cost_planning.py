"""Plans and questions by expected cost: act, ask for help, or ask which goal was meant.

An episode costs `action` for each action, `mess` for each time the object gets into a state out of
reach that the goal does not want it in, and `help` and `waiting` if a person does it in the end.
With k actions left, an object in x and a known goal g the least expected cost is

    V_0(g, x) = 0 if x fulfils g, else help + waiting
    V_k(g, x) = 0 if x fulfils g, else the less of help + waiting and, within reach,
                min over a of action + sum over x' of p(x' | x, a) (V_k-1(g, x') + mess(g, x')).

A robot that is not sure of the goal pursues m by the plan for m. If g was meant, it costs J(m, g):
the same sum along the plan for m, which ends where x fulfils m, with help + waiting if that is not
g. Given P(g) the robot does what costs least of

    to pursue m      sum over g of P(g) J(m, g)
    to ask for help  help + waiting
    to ask which     question + waiting + sum over g of P(g) V(g).
"""

from __future__ import annotations

import math
from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from likeme_inference.tabletop.arrays import FloatArray, IntArray
from likeme_inference.tabletop.checks import number, sums_to_one, table
from likeme_inference.tabletop.goal_inference import TIE
from likeme_inference.tabletop.goal_model import GoalModel

#: `CostPlan.action` where the plan is to ask for help, or nothing is to be done.
ASK = -1


class Costs(NamedTuple):
    """What an episode costs, in any unit; the default is that of one time of help.

    Attributes:
        action: one action.
        help: a person does what was wanted.
        mess: the object gets out of reach and is not wanted there.
        waiting: for an answer or for help.
        question: a person says which goal was meant.
    """

    action: float = 0.1
    help: float = 1.0
    mess: float = 1.0
    waiting: float = 0.0
    question: float = 0.2

    def checked(self) -> Costs:
        """The same.

        Raises:
            ValueError: a cost is negative or not finite.
        """
        for name, cost in self._asdict().items():
            if not 0 <= cost < math.inf:
                raise ValueError(f'Expected a cost of {name} of 0 or more, got {cost:g}.')
        return self


class CostPlan(NamedTuple):
    """Least expected costs and the actions of them, of every goal.

    Attributes:
        cost: V, shape [k, g, x], k actions left from 0 to the budget.
        action: shape [k, g, x]; ASK where help costs less, and where nothing is to be done.
        mistaken: J, the cost of pursuing m while g is meant, shape [k, m, g, x].
    """

    cost: FloatArray
    action: IntArray
    mistaken: FloatArray


class Question(IntEnum):
    """What is asked of a person."""

    #: To do what is wanted.
    HELP = 0
    #: Which goal was meant.
    WHICH = 1


class CostChoice(NamedTuple):
    """The choice of least expected cost and the costs it was chosen by.

    Attributes:
        question: what to ask; None: act, or leave the object.
        goal: that is pursued, or of which to ask first: the one that costs least.
        action: to take; None if something is asked, or the object is left where it is.
        act, help, which: expected costs of the three. `act` is inf if the plan of no goal acts.
    """

    question: Question | None
    goal: int
    action: int | None
    act: float
    help: float
    which: float


def cost_plan(model: GoalModel, costs: Costs, budget: int) -> CostPlan:
    """The plan of least cost for every goal, with up to `budget` actions.

    Raises:
        ValueError: a negative budget; costs that are negative or not finite.
    """
    if budget < 0:
        raise ValueError(f'Expected a budget of 0 actions or more, got {budget}.')
    costs.checked()
    wanted, states = model.goals > 0, len(model.transition)
    helped = costs.help + costs.waiting
    messed = costs.mess * (model.stuck & ~wanted)
    value = np.where(wanted, 0.0, helped)
    # Meant g, pursued m: a person puts right what ended at m alone, and what the robot gives up.
    both = wanted[:, None] & wanted[None]
    mistaken = np.where(both, 0.0, helped)
    values, actions, mistakes = [value], [np.full(value.shape, ASK)], [mistaken]
    order = np.array([_aimed_first(model, g) for g in range(len(wanted))])
    for _ in range(budget):
        quality = costs.action + np.einsum('xaf,gf->gxa', model.transition, value + messed)
        if model.possible is not None:
            quality = np.where(model.possible, quality, math.inf)
        least = quality.min(axis=-1)
        best = np.where(quality <= least[..., None] * (1 + TIE), order[:, None], math.inf)
        acts = ~wanted & ~model.stuck & (least < helped)
        action = np.where(acts, best.argmin(axis=-1), ASK)
        value = np.where(wanted, 0.0, np.where(acts, least, helped))
        rows = model.transition[np.arange(states), action.clip(min=0)]
        follow = costs.action + np.einsum('mxf,mgf->mgx', rows, mistaken + messed)
        mistaken = np.where(acts[:, None], follow, np.where(both, 0.0, helped))
        values.append(value)
        actions.append(action)
        mistakes.append(mistaken)
    return CostPlan(np.array(values), np.array(actions), np.array(mistakes))


def choose_by_cost(
    model: GoalModel,
    x_i: int,
    posterior: ArrayLike,
    costs: Costs,
    actions_left: int = 1,
    best: CostPlan | None = None,
) -> CostChoice:
    """Act, ask for help, or ask which goal was meant: whatever is expected to cost least.

    Args:
        model: of the object.
        x_i: its current state.
        posterior: P(G), shape [g].
        costs: see Costs.
        actions_left: budget of the plans.
        best: `cost_plan` of these, if at hand.

    Ties go to acting, then to asking for help. An object is left where it is only if it fulfils
    the likeliest goal.

    Raises:
        ValueError: an unknown state, a posterior that does not sum to 1, or see `cost_plan`.
    """
    x_i, p = number('x_i', x_i, len(model.transition)), np.asarray(posterior, dtype=np.float64)
    table('posterior', p, (len(model.goals),))
    sums_to_one('posterior', p)
    best = best or model.answers.get(
        (CostPlan, costs, actions_left), lambda: cost_plan(model, costs, actions_left)
    )
    k = len(best.cost) - 1
    likeliest = np.arange(len(p)) == p.argmax()
    does = (best.action[k, :, x_i] != ASK) | (likeliest & (model.goals[:, x_i] > 0))
    pursued = np.where(does, best.mistaken[k, :, :, x_i] @ p, math.inf)
    goal = int(pursued.argmin()) if does.any() else int(p.argmax())
    act, helped = float(pursued[goal]), costs.help + costs.waiting
    which = costs.question + costs.waiting + float(best.cost[k, :, x_i] @ p)
    least = min(act, helped, which)
    action = int(best.action[k, goal, x_i])
    question = (
        None if act <= least * (1 + TIE) else Question.HELP if helped <= least * (1 + TIE)
        else Question.WHICH
    )  # fmt: skip
    chosen = None if question is not None or action == ASK else action
    return CostChoice(question, goal, chosen, act, helped, which)


def _aimed_first(model: GoalModel, g: int) -> list[int]:
    """Rank of each action among equals: those aimed at the goal come first, shape [a]."""
    actions = range(model.transition.shape[1])
    aimed = model.aimed(g)
    return [a if a in aimed else a + len(actions) for a in actions]

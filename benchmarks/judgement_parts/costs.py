"""Regret of acting and asking by expected cost, with up to three actions.

Robots of 10 trials a pair in the real robot's table (judgement_robots, seed 3), the 12 changes
with a known goal; an action costs 0.1, help 1, a mess 1 or 10. The regret is the exact expected
cost in the table less that of the plan that knows it. Beside it: the best fixed threshold, found
in hindsight on the same robots, and the paper's rule, 0.5, on plans of greatest success.
"""

from __future__ import annotations

import time
from argparse import Namespace
from collections.abc import Sequence

import numpy as np

from judgement_robots import MODEL, TABLE, robots
from likeme_inference.tabletop import GoalModel, Plan, maximum_likelihood
from likeme_inference.tabletop.arrays import FloatArray, IntArray
from likeme_inference.tabletop.cost_planning import ASK, Costs, choose_by_cost, cost_plan
from likeme_inference.tabletop.goal_inference import TIE
from report import Bar

WORLDS, BUDGET = 1000, 3
#: Greatest regret with a mess of each cost.
REGRETS = {1.0: 0.016, 10.0: 0.040}
PAPER, THRESHOLDS = 0.5, tuple(np.linspace(0, 1, 21).tolist())


def bars(options: Namespace) -> list[Bar]:
    """Regret by cost with two estimates, by the best threshold, by the paper's."""
    number = WORLDS if options.worlds is None else max(1, options.worlds)
    learned = robots(number, seed=3)
    made: list[Bar] = []
    for mess, bar in REGRETS.items():
        costs = Costs(mess=mess)
        least = np.mean([_by_cost(_model(world), world, costs) for world in TABLE])
        regrets = {}
        for name in ('structured', 'shared', 'frequencies'):
            each = [
                _by_cost(_model(maximum_likelihood(alpha)), world, costs)
                for robot in learned
                for alpha, world in zip(getattr(robot, name), TABLE, strict=True)
            ]
            regrets[f'by cost, {name}'] = float(np.mean(each) - least)
        fixed = np.mean([_by_thresholds(robot.frequencies, costs) for robot in learned], axis=0)
        regrets['best fixed threshold'] = float(fixed.min() - least)
        regrets["the paper's rule"] = float(fixed[THRESHOLDS.index(PAPER)] - least)
        for name, regret in regrets.items():
            bound = bar if name == 'by cost, structured' else None
            made.append(Bar(f'regret, mess {mess:g}: {name}', regret, bound, '', n=number))
    return made + _speed()


def _model(transition: FloatArray) -> GoalModel:
    return GoalModel.of(transition, MODEL.domain)


def _by_cost(model: GoalModel, world: FloatArray, costs: Costs) -> float:
    return _cost(cost_plan(model, costs, BUDGET).action, world, costs)


def _by_thresholds(alpha: FloatArray, costs: Costs) -> list[float]:
    """Mean cost over objects of each threshold on the value of plans of greatest success."""
    models = [_model(maximum_likelihood(each)) for each in alpha]
    plans = [[model.plan(g, BUDGET) for g in range(len(model.goals))] for model in models]
    return [
        float(np.mean([
            _cost(_asking(each, threshold), world, costs)
            for each, world in zip(plans, TABLE, strict=True)
        ]))
        for threshold in THRESHOLDS
    ]  # fmt: skip


def _asking(plans: Sequence[Plan], threshold: float) -> IntArray:
    """Actions of plans of success, ASK below the threshold; shape [k, g, x]."""
    acted = [np.where(plan.value < threshold * (1 - TIE), ASK, plan.action) for plan in plans]
    return np.stack(acted, axis=1)


def _cost(action: IntArray, world: FloatArray, costs: Costs) -> float:
    """Exact mean cost of a policy [k, g, x] over the changes, in a world."""
    goals, stuck = MODEL.domain.goal_matrix > 0, MODEL.domain.stuck
    helped = costs.help + costs.waiting
    messed = costs.mess * (stuck & ~goals)
    value, states = np.where(goals, 0.0, helped), np.arange(len(stuck))
    for taken in action[1:]:
        rows = world[states, taken.clip(min=0)]
        acted = costs.action + np.einsum('gxf,gf->gx', rows, value + messed)
        value = np.where(goals, 0.0, np.where((taken == ASK) | stuck, helped, acted))
    return float(value[~goals & ~stuck].mean())


def _speed() -> list[Bar]:
    """Time of a decision by cost, plan and choice anew."""
    model, spent = MODEL.goal_model('pear'), []
    for _ in range(300):
        begin = time.perf_counter()
        choose_by_cost(model, 0, model.goal_posterior(0, 1), Costs(), BUDGET)
        spent.append(time.perf_counter() - begin)
    return [Bar('decision by cost: p50', 1e6 * float(np.median(spent)), None, 'us', n=len(spent))]

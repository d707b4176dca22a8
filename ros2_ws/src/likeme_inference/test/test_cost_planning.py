"""Plans and questions by expected cost, against the recursion and the plans of success."""

from __future__ import annotations

import numpy as np
import pytest

from likeme_inference.tabletop import TABLETOP, GoalModel, shipped
from likeme_inference.tabletop.cost_planning import (
    ASK,
    CostPlan,
    Costs,
    Question,
    choose_by_cost,
    cost_plan,
)

PEAR = shipped().goal_model('pear')
LEFT, RIGHT, OFFTABLE = range(3)


def random_model(seed: int) -> GoalModel:
    rng = np.random.default_rng(seed)
    return GoalModel.of(rng.dirichlet([0.4] * 3, (3, 6)), TABLETOP)


def recursion(model: GoalModel, costs: Costs, best: CostPlan, k: int, m: int, g: int, x: int):
    """J(m, g) by following the plan for m, one state after another."""
    helped = costs.help + costs.waiting
    if model.goals[m, x]:
        return 0.0 if model.goals[g, x] else helped
    action = best.action[k, m, x]
    if action == ASK:
        return helped
    total = costs.action
    for y, p in enumerate(model.transition[x, action]):
        mess = costs.mess * (model.stuck[y] and not model.goals[g, y])
        total += p * (mess + recursion(model, costs, best, k - 1, m, g, y))
    return total


@pytest.mark.parametrize('seed', range(5))
def test_costs_are_those_of_following_the_plan(seed: int) -> None:
    model, costs = random_model(seed), Costs(0.1, 1.0, 3.0, 0.2, 0.3)
    best = cost_plan(model, costs, 3)
    for k in range(4):
        for m in range(3):
            for g in range(3):
                for x in range(3):
                    expected = recursion(model, costs, best, k, m, g, x)
                    assert best.mistaken[k, m, g, x] == pytest.approx(expected, abs=1e-12)
    every = np.arange(3)
    assert best.mistaken[:, every, every] == pytest.approx(best.cost)


@pytest.mark.parametrize('seed', range(5))
def test_no_policy_costs_less(seed: int) -> None:
    """With one action left, against each action and help."""
    model, costs = random_model(seed), Costs(0.1, 1.0, 0.5)
    best = cost_plan(model, costs, 1)
    for g, x in ((0, 1), (1, 0), (2, 0), (2, 1)):
        each = [
            costs.action
            + sum(
                p * ((not model.goals[g, y]) + 0.5 * (model.stuck[y] and not model.goals[g, y]))
                for y, p in enumerate(row)
            )
            for row in model.transition[x]
        ]
        assert best.cost[1, g, x] == pytest.approx(min(1.0, *each))


def test_without_other_costs_it_is_the_plan_of_success() -> None:
    best = cost_plan(PEAR, Costs(action=0, help=1, mess=0), 3)
    for g in range(3):
        success = PEAR.plan(g, 3)
        assert best.cost[:, g] == pytest.approx(1 - success.value)


def test_a_mess_is_avoided_and_dear_actions_are_not_taken() -> None:
    transition = np.tile(np.eye(3)[:, None], (1, 6, 1))
    transition[LEFT, 1] = 0.0, 0.9, 0.1
    transition[LEFT, 4] = 0.2, 0.8, 0.0
    model = GoalModel.of(transition, TABLETOP)
    careless, careful = (cost_plan(model, Costs(mess=mess), 1) for mess in (0.0, 10.0))
    assert (careless.action[1, RIGHT, LEFT], careful.action[1, RIGHT, LEFT]) == (1, 4)
    assert cost_plan(model, Costs(action=2.0), 3).action[3, RIGHT, LEFT] == ASK
    # Out of reach there is help alone.
    assert careful.action[1, RIGHT, OFFTABLE] == ASK
    assert careful.cost[1, RIGHT, OFFTABLE] == 1.0


def test_what_is_asked_follows_from_goals_and_costs() -> None:
    cheap = Costs(question=0.05)
    sure = choose_by_cost(PEAR, LEFT, [0, 1, 0], cheap, 3)
    assert sure.question is None
    assert (sure.goal, sure.action) == (RIGHT, 4)
    assert sure.act == pytest.approx(cost_plan(PEAR, cheap, 3).cost[3, RIGHT, LEFT])
    unsure = choose_by_cost(PEAR, LEFT, [0, 0.5, 0.5], cheap, 3)
    assert (unsure.question, unsure.action) == (Question.WHICH, None)
    assert unsure.which < min(unsure.act, unsure.help)
    dear = choose_by_cost(PEAR, LEFT, [0, 0.5, 0.5], Costs(question=5, help=0.15), 3)
    assert dear.question is Question.HELP
    # Nearly sure: the small chance of another goal is worth no question.
    assert choose_by_cost(PEAR, LEFT, [0, 0.98, 0.02], Costs(), 3).question is None


def test_an_object_where_it_is_wanted_is_left() -> None:
    chosen = choose_by_cost(PEAR, RIGHT, [0.05, 0.95, 0], Costs(), 3)
    assert (chosen.question, chosen.goal, chosen.action) == (None, RIGHT, None)
    assert chosen.act == pytest.approx(0.05)


def test_other_goals_than_states() -> None:
    model = GoalModel.of(PEAR.transition, np.array([[1.0, 1, 0], [0, 0, 1]]))
    best = cost_plan(model, Costs(), 2)
    assert best.cost[:, 0, :2].tolist() == [[0, 0]] * 3
    assert choose_by_cost(model, LEFT, [0, 1], Costs(), 2, best).goal == 1


@pytest.mark.parametrize(
    ('call', 'message'),
    [
        (
            lambda: cost_plan(PEAR, Costs(mess=-1), 1),
            'Expected a cost of mess of 0 or more, got -1',
        ),
        (lambda: cost_plan(PEAR, Costs(), -1), 'Expected a budget of 0 actions or more, got -1'),
        (lambda: choose_by_cost(PEAR, 3, [0, 1, 0], Costs()), 'Expected x_i from 0 to 2, got 3'),
        (lambda: choose_by_cost(PEAR, 0, [0, 1, 1], Costs()), 'Expected posterior to sum to 1'),
        (lambda: choose_by_cost(PEAR, 0, [0, 1], Costs()), 'Expected posterior of shape'),
    ],
)
def test_bad_arguments_are_refused(call, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call()

"""Sensitivity to the prior: the paper's decisions, and where they change in closed form."""

from __future__ import annotations

import numpy as np
import pytest

from likeme_inference.tabletop import (
    Domain,
    Prior,
    PriorSetting,
    RobotModel,
    TrialCounts,
    prior_sensitivity,
    shipped,
    turning_points,
)
from likeme_inference.tabletop.sensitivity import GRID, NO_ACTION, REFERENCE

MODEL = shipped()


def test_the_reference_is_the_papers() -> None:
    found = prior_sensitivity(MODEL)

    assert found.settings[0] == REFERENCE == PriorSetting(Prior.OWN, 0.0)
    assert len(found.changes) == 12
    # Fig 8: the true goal in all, asking for the pear from RIGHT to LEFT alone.
    assert (found.goal[0] == [change.x_f for change in found.changes]).all()
    assert [tuple(found.changes[c]) for c in np.flatnonzero(found.asks[0])] == [('pear', 1, 0)]
    assert not found.differs[0].any()
    labels = [setting.label for setting in GRID]
    assert labels[:4] == ['ML', '0.01', '0.03', '0.09']
    assert labels[-2:] == ['shared', 'structured']


@pytest.mark.parametrize('setting', [GRID[3], GRID[7], *GRID[-2:]], ids=lambda s: s.label)
def test_each_setting_is_its_goal_model(setting: PriorSetting) -> None:
    found = prior_sensitivity(MODEL, [REFERENCE, setting])
    for c, (name, x_i, x_f) in enumerate(found.changes):
        model = MODEL.goal_model(name, concentration=setting.concentration, prior=setting.prior)
        assert found.posterior[1, c] == pytest.approx(model.goal_posterior(x_i, x_f))
        reached = model.success(x_i, int(found.goal[1, c]))
        assert found.success[1, c] == pytest.approx(reached.max())
        assert found.asks[1, c] == (reached.max() < 0.5)


def test_a_fitted_prior_takes_another_action() -> None:
    found = prior_sensitivity(MODEL)
    other = [
        (found.settings[s].label, found.changes[c])
        for s, c in np.argwhere(found.action != found.action[0])
    ]
    assert [(label, tuple(change)) for label, change in other] == [
        ('shared', ('lemon', 0, 1)),
        ('structured', ('lemon', 0, 1)),
    ]


def test_turning_points_are_those_of_the_closed_form() -> None:
    """(n + alpha) / (N + 3 alpha) = 1/2 at alpha = 2 n - N, of the best action."""
    found, turning = prior_sensitivity(MODEL, [REFERENCE]), turning_points(MODEL)
    for c, turn in enumerate(turning):
        name, x_i, x_f = turn.change
        n = MODEL.objects[name].counts[x_i, found.action[0, c], x_f]
        expected = 2 * n - 10
        if expected < 0:
            assert (turn.what, np.isnan(turn.concentration)) == ('', True)
        else:
            assert turn.what == 'asks'
            assert turn.concentration == pytest.approx(expected, rel=0.002)
            assert turn.concentration > expected


def test_goals_that_are_sets_and_one_that_is_fulfilled() -> None:
    kitchen = Domain(
        ('pan', 'plate', 'floor'), ('tip', 'lift'),
        {'indoors': ('pan', 'plate'), 'served': ('plate',)}, {'tip': 'served'},
        frozenset({'floor'}),
    )  # fmt: skip
    rows = (TrialCounts('egg', 0, 0, (0, 2, 8), 'a'), TrialCounts('egg', 0, 1, (9, 1, 0), 'a'))
    model = RobotModel('cook', '1', {'a': ''}, rows, kitchen)
    found = prior_sensitivity(model, [REFERENCE, PriorSetting(Prior.OWN, 3.0)])

    assert {(c.x_i, c.x_f) for c in found.changes} == {(0, 1), (0, 2), (1, 0), (1, 2)}
    assert found.posterior.shape == (2, 4, 2)
    indoors = found.goal == 0
    # The egg is indoors already.
    assert (found.action[indoors] == NO_ACTION).all()
    assert np.isnan(found.success[indoors]).all()
    assert not found.asks[indoors].any()


def test_refusals() -> None:
    with pytest.raises(ValueError, match='Expected at least one prior'):
        prior_sensitivity(MODEL, [])
    with pytest.raises(ValueError, match='Expected 0 < low < high'):
        turning_points(MODEL, low=1.0, high=1.0)

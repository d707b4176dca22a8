"""Help rate and log loss of an object that is left out."""

from __future__ import annotations

import numpy as np
import pytest

from likeme_core.world import load_world
from likeme_experiments.evaluation.new_object import new_object, untried_log_loss
from likeme_inference.tabletop import help_rate, shipped
from likeme_inference.tabletop.prior import Prior

MODEL = shipped()


@pytest.mark.parametrize('prior', list(Prior))
def test_runs_are_reproducible_and_start_from_the_others_alone(prior: Prior) -> None:
    one, again = (new_object(MODEL, prior, seeds=2, checkpoints=(0, 1)) for _ in range(2))
    assert np.array_equal(one.help_rate, again.help_rate)
    # Without trials of the object there is nothing that seeds could change.
    assert one.error[0] == pytest.approx(0, abs=1e-12)
    world = np.array([known.transition for known in MODEL.objects.values()])
    assert (one.help_rate > help_rate(world, world)).all()


def test_borrowing_helps_an_untried_object() -> None:
    by_prior = {prior: new_object(MODEL, prior, 1, (0,)).help_rate[0] for prior in Prior}
    assert by_prior[Prior.STRUCTURED] < by_prior[Prior.SHARED] < by_prior[Prior.OWN]
    losses = [untried_log_loss(MODEL, prior) for prior in (Prior.STRUCTURED, Prior.SHARED, None)]
    assert losses == sorted(losses)
    assert untried_log_loss(MODEL, Prior.OWN) == pytest.approx(np.log(3))


@pytest.mark.parametrize('name', ['one_more_manner', 'three_bins'])
def test_borrowing_is_never_much_worse_than_pooling(name: str) -> None:
    other = shipped(load_world(name))
    assert untried_log_loss(other, Prior.STRUCTURED) < untried_log_loss(other, None) + 0.002

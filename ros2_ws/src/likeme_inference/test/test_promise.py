"""A promised rate of success: by the model, and kept whatever the world does."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from likeme_inference.tabletop.promise import Promise, asking_probabilities, promise

SUCCESSES = [0.4, 0.9, 0.7, 0.7, 0.95]


@pytest.mark.parametrize('target', [0.5, 0.73, 0.8, 0.9, 0.95, 1.0])
def test_the_model_predicts_the_target_with_the_least_help(target: float) -> None:
    asked = asking_probabilities(SUCCESSES, target)
    predicted = np.mean(asked + (1 - asked) * np.array(SUCCESSES))
    assert predicted == pytest.approx(max(target, np.mean(SUCCESSES)))
    assert asked[2] == asked[3]
    for whole in product([0, 1], repeat=5):
        kept = np.mean(np.array(whole) + (1 - np.array(whole)) * SUCCESSES)
        assert kept < target - 1e-12 or sum(whole) >= asked.sum() - 1e-9


def test_the_first_threshold_lets_the_prediction_meet_the_target() -> None:
    made = promise(SUCCESSES, 0.9)
    assert [made.asks(success) for success in SUCCESSES] == [True, False, False, False, False]
    assert not any(promise(SUCCESSES, 0.5).asks(success) for success in SUCCESSES)
    assert all(promise(SUCCESSES, 1.0).asks(success) for success in SUCCESSES)


@pytest.mark.parametrize('known', [1.0, 0.5])
@pytest.mark.parametrize('real', [0.3, 0.6, 0.97])
def test_it_is_kept_whatever_the_world_does(real: float, known: float) -> None:
    """Success is the same for every action, and has nothing to do with what is predicted."""
    rng = np.random.default_rng(0)
    here, missed, episodes = promise(SUCCESSES, 0.9), 0, 6000
    for _ in range(episodes):
        acted = not here.asks(float(rng.choice(SUCCESSES)))
        reached = bool(rng.random() < real)
        missed += acted and not reached
        here = here.after(acted, reached if rng.random() < known else None, known)
    # Nothing to be asked about where the robot never misses that often.
    expected = min(0.1, 1 - real)
    assert missed / episodes == pytest.approx(expected, abs=0.012)


def test_an_end_that_was_not_seen_changes_nothing() -> None:
    here = Promise(0.9, 0.5)
    assert here.after(acted=True, reached=None) == here
    assert here.after(acted=True, reached=False, known=0.5).threshold == pytest.approx(0.68)
    assert here.after(acted=False, reached=None, known=0.5).threshold == pytest.approx(0.49)


def test_it_says_what_was_promised_and_kept() -> None:
    here = Promise(0.9, 0.5)
    assert here.sentence == 'promised 90%, nothing tried yet'
    here = here.after(acted=True, reached=True).after(acted=False, reached=None)
    here = here.after(acted=True, reached=False).after(acted=True, reached=True)
    assert here.sentence == 'promised 90%, kept 75% of the last 4'


def test_what_was_perhaps_meant_counts_for_its_probability() -> None:
    here = Promise(0.9, 0.5).after(acted=True, reached=0.7)
    assert here.threshold == pytest.approx(0.5 + 0.1 * (0.3 - 0.1))
    assert here.after(acted=True, reached=True).kept == pytest.approx(0.85)


@pytest.mark.parametrize(
    ('call', 'message'),
    [
        (lambda: asking_probabilities([], 0.9), 'Expected probabilities'),
        (lambda: asking_probabilities([0.5, 1.5], 0.9), 'Expected probabilities'),
        (lambda: promise([0.5], 1.1), 'Expected probabilities'),
        (lambda: Promise(0.9, 0.5).after(True, True, 0.0), 'above 0 up to 1, got 0'),
    ],
)
def test_bad_arguments_are_refused(call, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call()

"""Gaze following of a blindfolded mentor: the pattern of Fig 6, and older infants."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from likeme_experiments.evaluation.blindfold_detection import (
    blindfold_probabilities,
    detection_correct,
)
from likeme_experiments.evaluation.blindfold_groups import (
    GROUPS,
    differs_from_zero,
    follows_more,
    group_score,
    group_turns,
)
from likeme_gaze import blindfold_probability, known
from likeme_gaze.beliefs import Gaussian, independent
from likeme_gaze.blindfold import FIGURE_GROUPS, InfantGroup, WornBlindfold, infant, scores
from likeme_gaze.chain import HeadModel, chain, execution_noise
from likeme_gaze.checks import FloatArray
from likeme_gaze.reverse import VARIANCE_INFLATION, log_evidence
from likeme_gaze.simulation import DEGREE


@pytest.mark.parametrize('group', GROUPS, ids=lambda group: group.name)
def test_groups_follow_as_the_infants_do(group: InfantGroup) -> None:
    score = group_score(group_turns(7, group, 12))
    if group.follows:
        assert score.mean > 3
    else:
        assert abs(score.mean) < 0.5


def test_sixty_agents_show_the_pattern() -> None:
    baseline, windowed, opaque = (group_turns(8, group, 20) for group in FIGURE_GROUPS)
    assert follows_more(np.concatenate([baseline, windowed]), opaque) < 1e-6
    assert differs_from_zero(opaque) > 0.05


def test_scores() -> None:
    turned = DEGREE * np.array([[31.0, 44.0, -33.0, 10.0], [-45.0, -45.0, -45.0, 0.0]])
    assert scores(turned, 30 * DEGREE) == pytest.approx([1, -3])
    assert scores(turned, 35 * DEGREE) == pytest.approx([1, -3])
    assert scores(turned, 44.5 * DEGREE) == pytest.approx([0, -3])


def test_an_agent_does_not_depend_on_the_others() -> None:
    together = group_turns(9, FIGURE_GROUPS[2], 3)
    alone = group_turns(9, FIGURE_GROUPS[2], 1, first=2)
    assert (together[2] == alone[0]).all()


def test_only_agents_with_experience_account_for_the_blindfold() -> None:
    knows = {
        kind: infant(np.random.default_rng(1), kind).blindfold is not None
        for kind in WornBlindfold
    }
    assert knows == {
        WornBlindfold.UNKNOWN: False,
        WornBlindfold.WINDOWED: False,
        WornBlindfold.OPAQUE: True,
        WornBlindfold.SEE_THROUGH: True,
    }


def test_a_blindfold_is_detected_from_movements() -> None:
    """Five looks at one goal end close together, blindfolded turns do not; one tells nothing."""
    right = detection_correct(
        np.array([blindfold_probabilities(3, agent) for agent in range(4)])
    ).mean(axis=(0, 2, 3))
    assert right[0] < 0.75
    assert right[-1] > 0.95


def test_the_evidence_is_the_density_of_all_executions() -> None:
    """Of a goal that is all but known the model is linear: the joint density in one piece."""
    model = infant(np.random.default_rng(2), WornBlindfold.UNKNOWN, points=40).head
    prior = independent(Gaussian(np.array([300.0, 200.0]), 1e-6 * np.eye(2)), known([0.1]))
    linear = chain(model, prior)
    step = np.array([0.03, 6.0])
    seen = linear.final.mean + step * np.random.default_rng(4).normal(size=(2, 3, 2))
    found = np.array([log_evidence(model, prior, final.copy()) for final in seen.swapaxes(0, 1)])
    again = log_evidence(model, Gaussian(*(np.stack([p, p, p]) for p in prior)), seen)
    assert again == pytest.approx(found)
    # What all models have in common drops out of the difference of two observations.
    expected = [joint_log_density(model, prior, final) for final in seen.swapaxes(0, 1)]
    assert np.diff(found) == pytest.approx(np.diff(expected), rel=1e-3, abs=1e-3)


def joint_log_density(model: HeadModel, prior: Gaussian, final: FloatArray) -> float:
    """log N of all executions stacked: noise of their own, the rest in common."""
    linear = chain(model, prior)
    noise = execution_noise(model, linear)
    gain = linear.sensitivity
    through = gain.T @ prior.covariance @ gain
    common = VARIANCE_INFLATION * (linear.final.covariance - through - noise) + through
    count = len(final)
    joint = np.kron(np.ones((count, count)), common) + np.kron(np.eye(count), noise)
    return float(
        stats.multivariate_normal.logpdf(final.ravel(), np.tile(linear.final.mean, count), joint)
    )


def test_detection_needs_blindfold_experience() -> None:
    agent = infant(np.random.default_rng(1), WornBlindfold.UNKNOWN)
    prior = independent(Gaussian(np.zeros(2), np.eye(2)), known([0.0]))
    with pytest.raises(ValueError, match='Expected an agent with experience of a blindfold'):
        blindfold_probability(agent, prior, np.zeros((2, 2)))
    knowing = infant(np.random.default_rng(1), WornBlindfold.OPAQUE)
    with pytest.raises(ValueError, match='Expected a probability above 0 and below 1, got 1'):
        blindfold_probability(knowing, prior, np.zeros((2, 2)), before=1.0)

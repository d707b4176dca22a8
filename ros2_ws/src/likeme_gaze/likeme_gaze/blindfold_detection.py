"""Detecting a blindfold from head movements by Bayesian model comparison.

Repeated fixations of one goal end close together; turns under an opaque blindfold are unrelated to
any goal. The evidence of the observed final states under the policy π is compared with that under
π_B, the goal marginalised in both.
"""

from __future__ import annotations

import numpy as np
from scipy.special import expit, logit

from likeme_gaze.beliefs import Gaussian
from likeme_gaze.checks import FloatArray
from likeme_gaze.gaze_model import GazeModel
from likeme_gaze.reverse import log_evidence


def blindfold_probability(
    model: GazeModel, prior: Gaussian, final: FloatArray, before: float = 0.5
) -> FloatArray:
    """P(the mentor is blindfolded | x_i, x_f of K executions), shape (...).

    Args:
        model: an agent with blindfold experience.
        prior: of (goal, x_i) in the mentor's frame (..., 2 + S).
        final: x_f of each execution (K, ..., F), distances included.
        before: prior probability of a blindfold.

    Raises:
        ValueError: an agent without blindfold experience, or a prior that is 0 or 1.
    """
    if model.blindfold is None:
        raise ValueError('Expected an agent with experience of a blindfold, got one without.')
    if not 0 < before < 1:
        raise ValueError(f'Expected a probability above 0 and below 1, got {before:g}.')
    seeing, covered = (
        log_evidence(model.mentor_head(blindfolded), prior, final) for blindfolded in (False, True)
    )
    return np.asarray(expit(covered - seeing + logit(before)))

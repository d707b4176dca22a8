"""Whether a mentor can see, by its movements alone: the agent's two policies as two explanations.

Five looks at one goal end close together; turns under an opaque blindfold have nothing in common.
An agent that has known both tells them apart by Bayesian model comparison: how likely its policy π
and its policy π_B make what it saw, each with the goal summed out.
"""

from __future__ import annotations

import numpy as np
from scipy.special import expit, logit

from likeme_gaze.beliefs import Gaussian
from likeme_gaze.checks import FloatArray
from likeme_gaze.gaze_model import GazeModel
from likeme_gaze.reverse import log_evidence


def eyes_covered(
    model: GazeModel, prior: Gaussian, final: FloatArray, before: float = 0.5
) -> FloatArray:
    """P(the mentor is blindfolded | x_i, x_f of K executions), shape (...).

    Args:
        model: an agent with experience of a blindfold.
        prior: of (goal, x_i) in the mentor's frame (..., 2 + S).
        final: x_f of each execution (K, ..., F), distances included.
        before: the probability before any movement was seen.

    Raises:
        ValueError: an agent that never wore a blindfold, or a probability that decides beforehand.
    """
    if model.blindfold is None:
        raise ValueError('Expected an agent with experience of a blindfold, got one without.')
    if not 0 < before < 1:
        raise ValueError(f'Expected a probability above 0 and below 1, got {before:g}.')
    seeing, covered = (
        log_evidence(model.mentor_head(blindfolded), prior, final) for blindfolded in (False, True)
    )
    return np.asarray(expit(covered - seeing + logit(before)))

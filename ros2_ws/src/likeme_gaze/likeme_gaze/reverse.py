"""From a seen change back to the goal behind it: reverse inference (Goal Inference, Fig 1a).

`reverse_inference` is the paper's step: one observation, one linearisation around the prior.
`infer_goal` uses several observations of one goal together and linearises where they lead.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from likeme_gaze.beliefs import Gaussian, condition, independent, mahalanobis, mixture
from likeme_gaze.chain import GOAL, Chain, HeadModel, chain, execution_noise
from likeme_gaze.checks import FloatArray

#: Linearisations when the evidence has to lead away from the prior.
FIRST_PASSES = 4
#: Distances that are tried when none was seen.
DISTANCES = 24
#: How far the squared errors of policy and transition exceed the variance they claim, measured
#: on thirty agents' own goals (training rectangle, seeds apart from every test): 1.25 +- 0.04. One
#: lengthscale has to serve near goals, where directions change fast, and far ones.
UNDERSTATED = 1.25


class Reversed(NamedTuple):
    """What one observed final state says.

    Attributes:
        action: posterior of the action (..., A).
        goal_and_start: posterior of (g, x_i) (..., 2 + S).
        predicted: the chain before the observation.
    """

    action: Gaussian
    goal_and_start: Gaussian
    predicted: Chain

    @property
    def goal(self) -> Gaussian:
        """Posterior of the goal (..., 2)."""
        return self.goal_and_start.part(0, GOAL)


def reverse_inference(
    model: HeadModel,
    goal: Gaussian,
    start: Gaussian,
    observed: FloatArray,
    keep_coupling: bool = True,
) -> Reversed:
    """P(a | x_i, x_f) and P(g, x_i | x_i, x_f) in closed form.

    With J = Cov[z, (a, x_i)] Cov[(a, x_i)]⁻¹ the goal's covariance is S_z - J (S_a - S_a|x_f) J';
    J need not be formed, since Cov[z, x_f] = Cov[z, (a, x_i)] B with B the transition's gain.

    Args:
        model: policy and transition.
        goal: prior of the goal (..., 2).
        start: belief about x_i (..., S).
        observed: x_f (..., F).
        keep_coupling: whether action and start stay correlated.
    """
    linear = chain(model, independent(goal, start), keep_coupling)
    width = linear.action.mean.shape[-1]
    moved = condition(
        linear.moved, linear.final, linear.moved.covariance @ linear.by_action, observed
    )
    found = condition(linear.start, linear.final, linear.cross @ linear.by_action, observed)
    return Reversed(moved.part(0, width), found, linear)


class Evidence(NamedTuple):
    """Several executions of one goal, as far as a linear-Gaussian model needs to know them.

    Attributes:
        executions: how many.
        mean: average x_f (..., F), or without its last coordinate, the distance (..., F - 1).
    """

    executions: int
    mean: FloatArray


def infer_goal(
    model: HeadModel, prior: Gaussian, evidence: Evidence, around: Gaussian | None = None
) -> Gaussian:
    """Posterior of (g, x_i) given all executions, linearised around where it ends.

    Executions differ by their own noise only, so the average of K has their noise / K, while what
    the model does not know of itself stays, however often one looks.

    Args:
        model: policy and transition.
        prior: of (g, x_i) (..., 2 + S).
        evidence: what was seen.
        around: a good guess of the result, such as the posterior without the last observation:
            then one linearisation is made there; without it several, the first around the prior.
    """
    if evidence.mean.shape[-1] < model.transition.targets.shape[1]:
        return _at_any_distance(model, prior, evidence)
    if around is not None:
        return _update(model, prior, around, evidence)[0]
    return _iterated(model, prior, evidence)[0]


def log_evidence(model: HeadModel, prior: Gaussian, final: FloatArray) -> FloatArray:
    """log p(x_f of all executions | x_i) under a model (...), less what all models have in common.

    The average of K executions counts as `infer_goal` sees it; how far they are from each other
    is up to their own noise.

    Args:
        model: policy and transition.
        prior: of (g, x_i) (..., 2 + S).
        final: x_f of each execution (K, ..., F), distances included.
    """
    mean = final.mean(axis=0)
    belief, density = _iterated(model, prior, Evidence(len(final), mean))
    noise = execution_noise(model, chain(model, belief))
    between = mahalanobis(Gaussian(mean, noise), final).sum(axis=0)
    volume = (len(final) - 1) * np.linalg.slogdet(noise)[1]
    return np.asarray(density - 0.5 * (between + volume))


def _iterated(
    model: HeadModel, prior: Gaussian, evidence: Evidence
) -> tuple[Gaussian, FloatArray]:
    belief, density = prior, np.zeros(())
    for _ in range(FIRST_PASSES):
        belief, density = _update(model, prior, belief, evidence)
    return belief, density


def _at_any_distance(model: HeadModel, prior: Gaussian, evidence: Evidence) -> Gaussian:
    """The posterior when the distance was not seen: a mixture over the distances it may have had.

    P(g | heading) = Σ_d P(g | heading, d) P(d | heading). One linearisation of so long a belief as
    a whole line of sight would fit no place on it; each of the mixture's parts is short.
    """
    known = model.policy.targets[:, -1]
    distances = np.linspace(known.min(), known.max(), DISTANCES)
    batch = evidence.mean.shape[:-1]
    last = np.broadcast_to(distances.reshape(-1, *[1] * (len(batch) + 1)), (DISTANCES, *batch, 1))
    first = np.broadcast_to(evidence.mean, (DISTANCES, *evidence.mean.shape))
    each = Evidence(evidence.executions, np.concatenate([first, last], axis=-1))
    priors = Gaussian(*(np.broadcast_to(part, (DISTANCES, *part.shape)) for part in prior))
    parts, density = _iterated(model, priors, each)
    weight = np.exp(density - density.max(axis=0))
    return mixture(parts, weight / weight.sum(axis=0))


def _update(
    model: HeadModel, prior: Gaussian, around: Gaussian, evidence: Evidence
) -> tuple[Gaussian, FloatArray]:
    """Linearise around one belief, then condition the prior on all the evidence.

    Returns the posterior and log p(evidence) up to a constant (...).
    """
    linear = chain(model, around)
    gain = linear.sensitivity
    flipped = np.swapaxes(gain, -1, -2)
    noise = execution_noise(model, linear)
    shared = linear.final.covariance - flipped @ around.covariance @ gain - noise
    doubt = UNDERSTATED * shared + noise / evidence.executions
    shift = ((prior.mean - around.mean)[..., None, :] @ gain)[..., 0, :]
    predicted = Gaussian(linear.final.mean + shift, flipped @ prior.covariance @ gain + doubt)
    surprise = mahalanobis(predicted, evidence.mean)
    density = -0.5 * (surprise + np.linalg.slogdet(predicted.covariance)[1])
    return condition(prior, predicted, prior.covariance @ gain, evidence.mean), density

"""The exact goal posterior of the learned model by importance sampling, without linearisation.

Each sample draws the goal, the errors of policy and transition by their Gaussian processes, and
the action of every execution; weights correct for the proposal distributions.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.interpolate import RectBivariateSpline

from likeme_gaze.beliefs import Gaussian, known, mahalanobis
from likeme_gaze.chain import HeadModel, chain
from likeme_gaze.checks import FloatArray
from likeme_gaze.gp.gaussian_processes import GaussianProcesses

#: Knots of the splines through a Gaussian process's mean and variance, along each of two inputs.
KNOTS = 41
#: Width of the goal's proposal distribution relative to the Gaussian posterior.
WIDER = 1.6


class ExactGoal(NamedTuple):
    """The posterior of the goal by weighted samples.

    Attributes:
        belief: its mean and covariance (2,), (2, 2).
        effective: effective sample size.
    """

    belief: Gaussian
    effective: float


class Surface(NamedTuple):
    """Mean and noise-free variance of each output over two inputs, the third fixed."""

    means: tuple[RectBivariateSpline, ...]
    variances: tuple[RectBivariateSpline, ...]

    def mean_at(self, points: FloatArray) -> FloatArray:
        """Means (n, 2) at points (n, 2)."""
        return np.stack([s.ev(*points.T) for s in self.means], axis=-1)

    def at(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Means and variances (n, 2) at points (n, 2)."""
        variance = np.stack([s.ev(*points.T) for s in self.variances], axis=-1)
        return self.mean_at(points), np.maximum(variance, 0)


def exact_goal(
    rng: np.random.Generator,
    model: HeadModel,
    prior: Gaussian,
    start: float,
    final: FloatArray,
    answer: Gaussian,
    samples: int = 1_000_000,
) -> ExactGoal:
    """Importance samples from the goal's posterior, mentor's frame.

    Args:
        rng: of the samples.
        model: policy and transition.
        prior: of the goal (2,).
        start: x_i, known.
        final: x_f of each execution (K, 2).
        answer: the Gaussian posterior of the goal, around which samples are drawn.
        samples: how many.
    """
    root = WIDER * np.linalg.cholesky(answer.covariance)
    drawn = rng.standard_normal((samples, 2))
    goal = answer.mean + drawn @ root.T
    log_weight = _log_gaussian(prior, goal) + 0.5 * (drawn**2).sum(axis=1)
    policy = surface(model.policy, _around(goal), start)
    turn, doubt = policy.at(goal)
    aimed = turn + np.sqrt(doubt) * rng.standard_normal((samples, 2))
    linear = chain(model, known(np.append(answer.mean, start)))
    done = np.concatenate([final - (start, 0.0), aimed[:: samples // 1000]])
    transition = surface(model.transition, _around(done), start)
    expected, unsure = transition.at(aimed)
    off = np.sqrt(unsure) * rng.standard_normal((samples, 2))
    noises = model.policy.noise_variance, model.transition.noise_variance
    slope = linear.by_action[: model.action_width]
    for seen in final:
        plan = aimed, expected, seen - off
        log_weight += _execution(rng, plan, transition, slope, noises)
    return _moments(goal, np.exp(log_weight - log_weight.max()))


def surface(gp: GaussianProcesses, box: FloatArray, start: float) -> Surface:
    """Splines through a Gaussian process over a box (2, 2) of its first two inputs."""
    axes = [np.linspace(low, high, KNOTS) for low, high in box]
    grid = np.stack(np.meshgrid(*axes, indexing='ij'), axis=-1).reshape(-1, 2)
    points = np.concatenate([grid, np.full((len(grid), 1), start)], axis=1)
    found = gp.regress(points, np.zeros((len(points), 3, 3)))
    variance = np.diagonal(found.covariance, axis1=1, axis2=2) - gp.noise_variance
    tables = [np.moveaxis(t.reshape(KNOTS, KNOTS, -1), -1, 0) for t in (found.mean, variance)]
    means, variances = (tuple(RectBivariateSpline(*axes, t) for t in table) for table in tables)
    return Surface(means, variances)


def gap(answer: Gaussian, exact: Gaussian) -> dict[str, float]:
    """Differences between the Gaussian posterior and the exact moments.

    `shift`: distance of the means in exact standard deviations; `widths`: geometric mean of the
    ratio of standard deviations, answer over exact; `kl`: KL(exact || answer) of the Gaussians.
    """
    ratio = np.linalg.solve(answer.covariance, exact.covariance)
    volume = float(np.log(np.linalg.det(ratio)))
    moved = float(mahalanobis(answer, exact.mean))
    return {
        'shift': float(np.sqrt(mahalanobis(exact, answer.mean))),
        'widths': float(np.exp(-volume / 4)),
        'kl': 0.5 * (float(np.trace(ratio)) - 2 - volume + moved),
    }


def _execution(
    rng: np.random.Generator,
    plan: tuple[FloatArray, FloatArray, FloatArray],
    transition: Surface,
    slope: FloatArray,
    noises: tuple[FloatArray, FloatArray],
) -> FloatArray:
    """Log weight of one execution: its action is drawn where aim and outcome agree (samples,).

    `plan`: the aim, where it leads, and the outcome less the transition's error, which is the
    same in all executions. The proposal is the action's posterior if the transition were linear
    with `slope` around the aim.
    """
    aimed, expected, outcome = plan
    of_action, of_final = noises
    spread = slope.T @ (of_action[:, None] * slope) + np.diag(of_final)
    gain = np.linalg.solve(spread, slope.T * of_action).T
    root = np.linalg.cholesky(np.diag(of_action) - gain @ slope.T * of_action)
    drawn = rng.standard_normal(aimed.shape)
    action = aimed + (outcome - expected) @ gain.T + drawn @ root.T
    away = ((outcome - transition.mean_at(action)) ** 2 / of_final).sum(axis=1)
    own = ((action - aimed) ** 2 / of_action).sum(axis=1)
    return np.asarray(-0.5 * (away + own) + 0.5 * (drawn**2).sum(axis=1))


def _around(points: FloatArray) -> FloatArray:
    """A box (2, 2) that holds all points with a margin."""
    low, high = points.min(axis=0), points.max(axis=0)
    margin = 0.25 * (high - low)
    return np.stack([low - margin, high + margin], axis=1)


def _log_gaussian(belief: Gaussian, points: FloatArray) -> FloatArray:
    """Log density up to a constant (n,)."""
    lower = np.linalg.cholesky(belief.covariance)
    scaled = np.linalg.solve(lower, (points - belief.mean).T)
    return np.asarray(-0.5 * (scaled**2).sum(axis=0))


def _moments(points: FloatArray, weights: FloatArray) -> ExactGoal:
    weights = weights / weights.sum()
    mean = weights @ points
    away = points - mean
    covariance = (weights[:, None] * away).T @ away
    return ExactGoal(Gaussian(mean, covariance), float(1 / (weights**2).sum()))

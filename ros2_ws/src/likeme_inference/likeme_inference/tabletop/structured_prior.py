"""A prior for each object from what it has in common with the others, any world.

A row r = (x_i, a) that is to move an object has two predictions of the outcomes of object o.

1. `population_prior`: trials of the same pair with other objects.
2. The same probability of ending elsewhere, but success (the target is reached, rather than the
   object left where it was) by a Gaussian process over log odds z,

    cov(z[i, r], z[j, r']) = sum over c of v_c E_c + S[i, j] (sum over c of u_c E_c),

   E_c the components of `latent_kernel` (all, direction, manner, mirror, pair), v_c the variances
   that all objects have in common, u_c those of single objects, S whom object o resembles.
   `structure_fit` fits v, u and the mirror with S = I, the identity.

S follows from the trials. With S = I, d_i is the posterior mean of what object i differs by from
all others and t_i the total variance of that,

    S[o, i] = d_o . d_i / sqrt((|d_o|^2 + t_o) (|d_i|^2 + t_i))    for i != o,

which is near 0 for an object with few trials: it borrows from all alike. Among the others S = I:
their differences from their own mean add up to about 0, which would make the mean look certain.

The weight of each prediction is its posterior probability given the trials of the object itself;
that of 2 a priori is (1 + sum of w) / (2 + n), w its probability for each of the n other objects
with trials, predicted as if that had none.

The prior of a row is the prediction from all trials but its own, as the Dirichlet of the same mean
and total variance; its own trials are added to it like to any other prior. Rows in which nothing
is to be moved (x_i out of reach, or the target already) have the prior of `shared_prior`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from likeme_inference.tabletop.arrays import FloatArray
from likeme_inference.tabletop.finite_domain import Domain
from likeme_inference.tabletop.laplace import LatentPosterior, laplace
from likeme_inference.tabletop.latent_kernel import RowKernel, row_kernel
from likeme_inference.tabletop.population_prior import (
    PopulationWeights,
    fit_population,
    population_prior,
)
from likeme_inference.tabletop.shared_prior import fit_weights, shared_prior
from likeme_inference.tabletop.structure_fit import Structure, fit_structure, kernel_over

#: Nodes of the Gauss-Hermite quadrature over a latent value.
NODES = 40
#: Pseudo-counts of a row lie between these.
LEAST, MOST = 0.05, 1e6
#: Least precision of a latent value.
FLATTEST = 1e-4
#: Greatest sum of S[o, i]^2 over the others in a kernel; below 1 it is positive definite.
ALIKE = 0.9


@dataclass(frozen=True, eq=False)
class StructuredPrior:
    """The prior of each object given the trials of all.

    Attributes:
        counts: shape [object, x_i, a, x_f]; an object without trials is allowed.
        domain: its actions are aimed at states.
        structure: variances and mirror, see `fit_structure`.
    """

    counts: FloatArray
    domain: Domain
    structure: Structure

    @classmethod
    def of(cls, counts: FloatArray, domain: Domain) -> StructuredPrior:
        """Fit the structure to the trials.

        counts: shape [object, x_i, a, x_f].

        Raises:
            ValueError: an action is aimed at no single state.
        """
        counts = np.asarray(counts, dtype=np.float64)
        return cls(counts, domain, fit_structure(counts, domain))

    @cached_property
    def similarity(self) -> FloatArray:
        """S, shape [object, object]; 1 on the diagonal."""
        alone, objects = self._alone, len(self.counts)
        own = np.tensordot(np.square(self.structure.own), self._rows.components, axes=1)
        size = len(own)
        blocks = alone.precision.reshape(objects, size, objects, size)
        differs = alone.weights.reshape(objects, size) @ own
        spread = np.array(
            [np.trace(own) - np.sum((own @ own) * blocks[o, :, o].T) for o in range(objects)]
        )
        scale = np.sqrt((differs**2).sum(axis=-1) + np.maximum(spread, 0.0))
        unit = differs / np.where(scale > 0, scale, 1.0)[:, None]
        alike = unit @ unit.T
        np.fill_diagonal(alike, 1.0)
        return np.asarray(alike)

    @cached_property
    def gp_weight(self) -> FloatArray:
        """Probability of prediction 2, shape [object]."""
        from scipy.special import expit, logit

        tried = self.counts.sum(axis=(1, 2, 3)) > 0
        untried_gain, own_gain = self._gains
        alone = np.where(tried, expit(untried_gain), 0.0)
        a_priori = (1 + alone.sum() - alone) / (2 + tried.sum() - tried)
        return np.asarray(expit(logit(a_priori) + own_gain))

    @cached_property
    def pseudo_counts(self) -> FloatArray:
        """The Dirichlet prior of every row, shape [object, x_i, a, x_f]."""
        objects, rows = len(self.counts), len(self._rows.pairs)
        alpha = self._population
        total = alpha.sum(axis=-1, keepdims=True)
        mean, square = alpha / total, alpha * (alpha + 1) / (total * (total + 1))
        success, squared = np.zeros((2, objects, rows))
        for o, (kernel, found) in enumerate(self._posteriors):
            here = slice(o * rows, (o + 1) * rows)
            success[o], squared[o] = (each[here] for each in _success(found, kernel))
        both, weight = self._rows.succeeded(alpha)[1], self.gp_weight[:, None]
        first = both / total[..., 0]
        second = first * (both + 1) / (total[..., 0] + 1)
        at, start = np.arange(rows), self._rows.pairs[:, 0]
        for x_f, p, p_squared in (
            (self._rows.aims, success, squared),
            (start, 1 - success, 1 - 2 * success + squared),
        ):
            mean[:, at, x_f] += weight * (first * p - mean[:, at, x_f])
            square[:, at, x_f] += weight * (second * p_squared - square[:, at, x_f])
        # Dirichlet of total s: sum of variances = (1 - sum of squared means) / (s + 1).
        variance = np.maximum((square - mean**2).sum(axis=-1), 1e-12)
        size = (1 - (mean**2).sum(axis=-1)) / variance - 1
        aims = self.domain.state_aims
        prior = shared_prior(self.counts, fit_weights(self.counts, aims, rounds=3), aims)
        x, a = self._rows.pairs.T
        prior[:, x, a] = mean * np.clip(size, LEAST, MOST)[..., None]
        return prior

    def borrowed(self, o: int, x_i: int, a: int) -> FloatArray:
        """How many trials of each object the prior of a row is worth, shape [object].

        The row's pseudo-counts, divided by influence: in prediction 1 the trials of the same pair,
        in prediction 2 the size of d z / d y over the rows of each object, (K - K G K) W. The
        object itself counts with its other rows. All 0 if no object has trials.
        """
        influence = self.counts[:, x_i, a].sum(axis=-1)
        influence[o] = 0.0
        share = influence / max(influence.sum(), 1.0)
        row = np.flatnonzero((self._rows.pairs == (x_i, a)).all(axis=-1))
        if len(row):
            objects, rows = len(self.counts), len(self._rows.pairs)
            at, (kernel, found) = o * rows + int(row[0]), self._posteriors[o]
            here = kernel[at] - kernel[at] @ found.precision @ kernel
            size = np.abs(here * found.curvature)
            size[at] = 0.0
            gp_share = size.reshape(objects, rows).sum(axis=-1)
            gp_share = gp_share / (gp_share.sum() or 1.0)
            share = self.gp_weight[o] * gp_share + (1 - self.gp_weight[o]) * share
        return np.asarray(share / (share.sum() or 1.0) * self.pseudo_counts[o, x_i, a].sum())

    @cached_property
    def _gains(self) -> FloatArray:
        """Log likelihood of an object's trials by prediction 2 less that by 1, shape [2, object].

        First of each trial as if the object had no others, then of all of them together. Both
        predict the same of trials that end elsewhere.
        """
        from scipy.special import betaln, xlogy

        reached, trials = self._rows.succeeded(self._trials)
        alpha, both = self._rows.succeeded(self._population)
        beta, missed = both - alpha, trials - reached
        by_pair = (betaln(alpha + reached, beta + missed) - betaln(alpha, beta)).sum(axis=-1)
        gains, alone = np.zeros((2, len(trials))), np.eye(len(trials))
        kernel, rows = kernel_over(self._rows, self.structure, alone), trials.shape[1]
        for o in np.flatnonzero(trials.sum(axis=-1) > 0):
            without = self._trials.copy()
            without[o] = 0
            untried = self._laplace(without, kernel)
            p = _success(untried, kernel)[0][o * rows : (o + 1) * rows]
            by_gp = xlogy(reached[o], p) + xlogy(missed[o], 1 - p)
            same = xlogy(reached[o], alpha[o] / both[o]) + xlogy(missed[o], beta[o] / both[o])
            gains[0, o] = (by_gp - same).sum()
            gains[1, o] = self._alone.evidence - untried.evidence - by_pair[o]
        return gains

    @cached_property
    def _rows(self) -> RowKernel:
        return row_kernel(self.domain, self.structure.mirror)

    @cached_property
    def _trials(self) -> FloatArray:
        """Counts of the rows, shape [object, row, x_f]."""
        return self._rows.trials(self.counts)

    @cached_property
    def _weights(self) -> PopulationWeights:
        return fit_population(self._rows, self._trials)

    @cached_property
    def _population(self) -> FloatArray:
        """Prediction 1, pseudo-counts of shape [object, row, x_f]."""
        return population_prior(self._rows, self._trials, self._weights)

    def _laplace(self, trials: FloatArray, kernel: FloatArray) -> LatentPosterior:
        reached, both = self._rows.succeeded(trials)
        return laplace(kernel, reached.ravel(), both.ravel())

    @cached_property
    def _alone(self) -> LatentPosterior:
        """The posterior with S = I, by which the similarity is told."""
        alone = np.eye(len(self.counts))
        return self._laplace(self._trials, kernel_over(self._rows, self.structure, alone))

    @cached_property
    def _posteriors(self) -> list[tuple[FloatArray, LatentPosterior]]:
        """Of each object the kernel by which it resembles the others, and the posterior."""
        found = []
        for o, row in enumerate(self.similarity):
            others = np.where(np.arange(len(row)) == o, 0.0, row)
            others *= np.sqrt(ALIKE / max(ALIKE, float(others @ others)))
            resembles = np.eye(len(row))
            resembles[o] += others
            resembles[:, o] += others
            kernel = kernel_over(self._rows, self.structure, resembles)
            found.append((kernel, self._laplace(self._trials, kernel)))
        return found


def _success(found: LatentPosterior, kernel: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean of p and of p^2 of each row given all trials but the row's own, shape [row].

    Each row's Gaussian, of variance C and mean m, is divided by the Gaussian of its own trials, of
    precision W and gradient g: precision 1 / C - W, precision times mean m / C - W m - g.
    """
    from scipy.special import expit

    covariance = np.diag(kernel) - np.einsum('ij,jk,ki->i', kernel, found.precision, kernel)
    # Where the approximation leaves no precision at all, hardly anything is known.
    left = np.maximum(1 / covariance - found.curvature, FLATTEST)
    mean = (found.mode / covariance - found.curvature * found.mode - found.weights) / left
    nodes, weights = np.polynomial.hermite_e.hermegauss(NODES)
    p = expit(mean[:, None] + nodes / np.sqrt(left)[:, None])
    weights = weights / weights.sum()
    return np.asarray(p @ weights), np.asarray(p**2 @ weights)

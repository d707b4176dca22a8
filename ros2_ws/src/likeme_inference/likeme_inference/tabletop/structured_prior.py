"""A prior for each object from what it has in common with the others, any world.

Two predictions of the outcomes of object o in row r = (x_i, a) are mixed.

1. The prior of `shared_prior`: trials of the same pair with other objects.
2. A Gaussian process over log odds z, p(x_f | x_i, a) = softmax z, with

    cov(z[o, r, f], z[o', r', f']) = sum over c of v_c E_c + S[o, o'] (sum over c of u_c E_c),

   E_c the components of `latent_kernel` (role of the outcome, direction, manner, mirror, pair),
   v_c the variances that all objects have in common, u_c those of single objects, S the
   similarity of objects. `structure_fit` fits v, u and the mirror.

S follows from the trials. With S = 1, d_o is the posterior mean of what object o differs by from
all others and t_o the total variance of that,

    S[o, o'] = d_o . d_o' / sqrt((|d_o|^2 + t_o) (|d_o'|^2 + t_o'))    for o != o',

which is near 0 for an object with few trials: it borrows from all alike.

The weight of each prediction is its posterior probability given the trials of the object itself;
that of 2 a priori is (1 + sum of w) / (2 + n), w its probability for each of the n other objects
with trials, predicted as if that had none.

The prior of a row is the prediction from all trials but its own, as the Dirichlet of the same mean
and total variance; its own trials are added to it like to any other prior. Rows in which nothing
is to be moved (x_i out of reach, or the target already) have prediction 1 alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from likeme_inference.tabletop.arrays import FloatArray
from likeme_inference.tabletop.finite_domain import Domain
from likeme_inference.tabletop.laplace import LatentPosterior, laplace, log_softmax
from likeme_inference.tabletop.latent_kernel import RowKernel, row_kernel
from likeme_inference.tabletop.shared_prior import fit_weights, shared_prior
from likeme_inference.tabletop.structure_fit import Structure, fit_structure, kernel_over

#: Draws for means over latent values, half of them mirrored; fixed, so that a prior is a function.
NODES = 512
#: Pseudo-counts of a row lie between these.
LEAST, MOST = 0.05, 1e6
#: Least precision of a latent value.
FLATTEST = 1e-4


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
        alone, own = self._alone, self._own
        objects, size = len(self.counts), len(own)
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
        objects, (x, a) = len(self.counts), self._rows.pairs.T
        states = len(self.domain.states)
        p = _drawn(self._posterior, self._kernel).reshape(objects, len(x), -1, states)
        gp_mean, gp_square = p.mean(axis=2), (p**2).mean(axis=2)
        alpha = self._same_pair[:, x, a]
        total = alpha.sum(axis=-1, keepdims=True)
        mean, weight = alpha / total, self.gp_weight[:, None, None]
        square = mean * (alpha + 1) / (total + 1)
        mixed = weight * gp_mean + (1 - weight) * mean
        second = weight * gp_square + (1 - weight) * square
        # Dirichlet of total s: sum of variances = (1 - sum of squared means) / (s + 1).
        variance = np.maximum((second - mixed**2).sum(axis=-1), 1e-12)
        size = (1 - (mixed**2).sum(axis=-1)) / variance - 1
        prior = self._same_pair.copy()
        prior[:, x, a] = mixed * np.clip(size, LEAST, MOST)[..., None]
        return prior

    def borrowed(self, o: int, x_i: int, a: int) -> FloatArray:
        """How many trials of each object the prior of a row is worth, shape [object].

        The row's pseudo-counts, divided by influence: in prediction 1 the trials of the same pair,
        in prediction 2 the norm of d z / d y over the rows of each object, (K - K G K) W. The
        object itself counts with its other rows. All 0 if no object has trials.
        """
        influence = self.counts[:, x_i, a].sum(axis=-1)
        influence[o] = 0.0
        share = influence / max(influence.sum(), 1.0)
        row = np.flatnonzero((self._rows.pairs == (x_i, a)).all(axis=-1))
        if len(row):
            objects, rows, states = len(self.counts), len(self._rows.pairs), len(self.counts[0])
            at = o * rows + int(row[0])
            here = self._covariance[at * states : (at + 1) * states]
            blocks = here.reshape(states, objects * rows, states).swapaxes(0, 1)
            norm = np.sqrt(((blocks @ self._posterior.curvature) ** 2).sum(axis=(1, 2)))
            norm[at] = 0.0
            gp_share = norm.reshape(objects, rows).sum(axis=-1)
            gp_share = gp_share / (gp_share.sum() or 1.0)
            share = self.gp_weight[o] * gp_share + (1 - self.gp_weight[o]) * share
        return np.asarray(share / (share.sum() or 1.0) * self.pseudo_counts[o, x_i, a].sum())

    @cached_property
    def _gains(self) -> FloatArray:
        """Log likelihood of an object's trials by prediction 2 less that by 1, shape [2, object].

        First of each trial as if the object had no others, then of all of them together.
        """
        from scipy.special import gammaln

        x, a = self._rows.pairs.T
        alpha, y = self._same_pair[:, x, a], self._trials
        total, trials = alpha.sum(axis=-1), y.sum(axis=-1)
        rows = (gammaln(alpha + y) - gammaln(alpha)).sum(axis=-1)
        by_pair = (rows + gammaln(total) - gammaln(total + trials)).sum(axis=-1)
        gains, alone = np.zeros((2, len(y))), np.eye(len(y))
        kernel = kernel_over(self._rows, self.structure, alone)
        for o in np.flatnonzero(trials.sum(axis=-1) > 0):
            without = y.copy()
            without[o] = 0
            untried = self._laplace(without, alone)
            at = slice(o * len(x), (o + 1) * len(x))
            mean = _drawn(untried, kernel)[at].mean(axis=1)
            gains[0, o] = (y[o] * np.log(mean * total[o, :, None] / alpha[o])).sum()
            gains[1, o] = self._alone.evidence - untried.evidence - by_pair[o]
        return gains

    @cached_property
    def _rows(self) -> RowKernel:
        return row_kernel(self.domain, self.structure.mirror)

    @cached_property
    def _own(self) -> FloatArray:
        """Covariance of what a single object differs by, shape [row * x_f, row * x_f]."""
        return np.asarray(
            np.tensordot(np.square(self.structure.own), self._rows.components, axes=1)
        )

    @cached_property
    def _trials(self) -> FloatArray:
        """Counts of the rows, shape [object, row, x_f]."""
        x, a = self._rows.pairs.T
        return np.asarray(self.counts[:, x, a])

    @cached_property
    def _same_pair(self) -> FloatArray:
        """Prediction 1."""
        aims = self.domain.state_aims
        return shared_prior(self.counts, fit_weights(self.counts, aims, rounds=3), aims)

    def _laplace(self, trials: FloatArray, similarity: FloatArray) -> LatentPosterior:
        kernel = kernel_over(self._rows, self.structure, similarity)
        return laplace(kernel, trials.reshape(-1, trials.shape[-1]))

    @cached_property
    def _alone(self) -> LatentPosterior:
        """The posterior with S = 1, by which the similarity is told."""
        return self._laplace(self._trials, np.eye(len(self.counts)))

    @cached_property
    def _posterior(self) -> LatentPosterior:
        return self._laplace(self._trials, self.similarity)

    @cached_property
    def _kernel(self) -> FloatArray:
        return kernel_over(self._rows, self.structure, self.similarity)

    @cached_property
    def _covariance(self) -> FloatArray:
        kernel = self._kernel
        return np.asarray(kernel - kernel @ self._posterior.precision @ kernel)


def _drawn(found: LatentPosterior, kernel: FloatArray) -> FloatArray:
    """Draws of p(x_f | row) given all trials but the row's own, shape [row, node, x_f].

    Each row's Gaussian, of precision L and mean m, is divided by the Gaussian of its own trials,
    of precision W and gradient g: precision L - W, precision times mean L m - W m - g.
    """
    rows, states = found.mode.shape
    blocks = []
    for at in (slice(r, r + states) for r in range(0, rows * states, states)):
        blocks.append(kernel[at, at] - kernel[at] @ found.precision @ kernel[:, at])
    covariance = np.array(blocks)
    left = np.linalg.inv((covariance + covariance.swapaxes(1, 2)) / 2) - found.curvature
    shifted = np.einsum('rfg,rg->rf', left, found.mode) - found.weights
    # Where the approximation leaves no precision at all, hardly anything is known.
    values, vectors = np.linalg.eigh(left)
    variance = 1 / np.maximum(values, FLATTEST)
    mean = np.einsum('rfk,rk,rgk,rg->rf', vectors, variance, vectors, shifted)
    # The symmetric root, as eigenvectors may turn with the last digit.
    root = np.einsum('rfk,rk,rgk->rfg', vectors, np.sqrt(variance), vectors)
    nodes = np.random.default_rng(0).standard_normal((NODES // 2, states))
    nodes = np.concatenate([nodes, -nodes])
    return np.asarray(np.exp(log_softmax(mean[:, None] + nodes @ root)))

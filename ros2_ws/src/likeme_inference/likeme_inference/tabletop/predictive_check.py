"""Could the model have made the trials? Posterior predictive, held-out and conditional checks.

The model: each row (object, x_i, a) has one p(X_f), and trials are independent draws from it. A
check compares a discrepancy of the trials with that of trials which the model makes, row by row.

| check | trials are made again from | twice | sees |
| --- | --- | --- | --- |
| `posterior_check` | the posterior after all trials | yes | a prior that overrules trials |
| `held_out_check` | the trials before, batch by batch | no | a wrong prior, change |
| `exchangeable_check` | the row's own trials, dealt out anew | no | change, whatever the prior |

twice: whether trials are predicted by themselves; then p tends to 1/2.

A row has one free probability for each final state, so the totals of a row alone cannot
contradict it: change is visible between batches (sources, sessions, parts in the order of the
trials). With many rows some p are small by chance: `overall` is one test of all rows,
`holm` corrects the p of single ones.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from likeme_inference.tabletop.arrays import BoolArray, FloatArray, IntArray
from likeme_inference.tabletop.checks import table

REPLICATIONS = 4000
#: Difference of two discrepancies up to which they are equal: rounding of the same sum.
EQUAL = 1e-9
#: Values in an array of replicated counts above which they are made in parts.
PART = 2_000_000


class PredictiveCheck(NamedTuple):
    """Discrepancies of the trials and of trials that the model made.

    Attributes:
        observed: shape [replication, ...row], or [1, ...row] where it depends on no draw.
        replicated: shape [replication, ...row].
        tested: rows with trials that are predicted, shape [...row].
    """

    observed: FloatArray
    replicated: FloatArray
    tested: BoolArray

    def p(self) -> FloatArray:
        """P(replicated discrepancy >= observed) of each row, shape [...row]; NaN if not tested.

        (1 + k) / (1 + replications), so that a Monte Carlo test of any level keeps it. Ties count
        as "at least": rows that hardly can differ have a p near 1.
        """
        return np.where(self.tested, _p(self.observed, self.replicated), np.nan)

    def overall(self, where: ArrayLike = True) -> float:
        """The p of the sum of the rows' discrepancies; NaN without a tested row.

        where: the rows to sum over, shape [...row].
        """
        rows = self.tested & np.asarray(where)
        if not rows.any():
            return float('nan')
        sums = [each[:, rows].sum(axis=-1) for each in (self.observed, self.replicated)]
        return float(_p(*sums))


def posterior_check(
    batches: IntArray,
    prior: ArrayLike,
    rng: np.random.Generator,
    replications: int = REPLICATIONS,
) -> PredictiveCheck:
    """Trials made again from the posterior after all of them (Gelman, Meng and Stern 1996).

    The discrepancy is Freeman and Tukey's, sum over batches and x_f of
    (sqrt(n) - sqrt(trials p(x_f)))^2, with the p that the replicated trials were made from. As the
    posterior has seen the trials, p is nearer 1/2 than uniform: a small p says much, another one
    little.

    Args:
        batches: trials, shape [batch, ...row, x_f].
        prior: Dirichlet pseudo-counts above 0 that broadcast to [...row, x_f].
        rng: of the replications.
        replications: number of draws.

    Raises:
        ValueError: batches or a prior of another shape, or not above 0.
    """
    batches, alpha = _checked(batches, prior)
    trials, after = batches.sum(axis=-1), alpha + batches.sum(axis=0)

    def part(size: int) -> tuple[FloatArray, FloatArray]:
        p = _dirichlet(np.broadcast_to(after, (size, *after.shape)), rng)
        expected = np.sqrt(trials[..., None] * p[:, None])
        again = rng.multinomial(trials, p[:, None])
        squares = [((np.sqrt(n) - expected) ** 2).sum(axis=(1, -1)) for n in (batches, again)]
        return squares[0], squares[1]

    return _in_parts(part, batches, replications, trials.sum(axis=0) > 0)


def held_out_check(
    batches: IntArray,
    prior: ArrayLike,
    rng: np.random.Generator,
    replications: int = REPLICATIONS,
    learned_from: int = 1,
) -> PredictiveCheck:
    """Each batch predicted from those before it, and compared before it is learned from.

    The discrepancy is the sum of -log p(batch | batches before), Dirichlet multinomial. Trials are
    made again in the same order, each batch learned from in its turn. No trial is used twice, so
    that p is valid: P(p <= u) <= u if model and prior are right. The prior must not be fitted to
    these trials.

    Args:
        batches: trials in the order they were made, shape [batch, ...row, x_f].
        prior: see `posterior_check`.
        rng: of the replications.
        replications: number of draws.
        learned_from: number of first batches that are not predicted; 0: the prior alone predicts
            the first.

    Raises:
        ValueError: see `posterior_check`; no batch is left to predict.
    """
    batches, alpha = _checked(batches, prior)
    if not 0 <= learned_from < len(batches):
        raise ValueError(f'Expected 0 to {len(batches) - 1} batches, got {learned_from}.')
    first, rest = alpha + batches[:learned_from].sum(axis=0), batches[learned_from:]
    trials = rest.sum(axis=-1)

    def surprise(made: Callable[[int, FloatArray], IntArray], size: int) -> FloatArray:
        before = np.broadcast_to(first, (size, *first.shape))
        total = np.zeros((size, *first.shape[:-1]))
        for k in range(len(rest)):
            n = made(k, before)
            total += _surprise(n, before)
            before = before + n
        return total

    observed = surprise(lambda k, _: rest[k][None], 1)

    def part(size: int) -> tuple[FloatArray, FloatArray]:
        return observed, surprise(
            lambda k, before: rng.multinomial(trials[k], _dirichlet(before, rng)), size
        )

    return _in_parts(part, batches, replications, trials.sum(axis=0) > 0)


def exchangeable_check(
    batches: IntArray, rng: np.random.Generator, replications: int = REPLICATIONS
) -> PredictiveCheck:
    """The trials of each row, dealt out to the batches anew: an exact test without a prior.

    If a row has one p(X_f), every order of its trials is equally likely, whatever p is. The
    discrepancy is G^2 / 2, sum over batches and x_f of n log(n / expected by the row's total).
    Rows with trials in one batch alone, or with one final state, cannot differ; only rows with
    trials in several batches are tested.

    Raises:
        ValueError: batches that are no counts.
    """
    batches, _ = _checked(batches, 1.0)
    size = batches.shape[1:-1]
    flat = batches.reshape(len(batches), -1, batches.shape[-1])
    trials = flat.sum(axis=-1)
    observed, replicated = (
        np.zeros((1, trials.shape[1])),
        np.zeros((replications, trials.shape[1])),
    )
    for r in range(trials.shape[1]):
        total = flat[:, r].sum(axis=0)
        outcomes = np.repeat(np.arange(len(total)), total)
        batch = np.repeat(np.arange(len(batches)), trials[:, r])
        expected = trials[:, r, None] * total / max(1, total.sum())
        dealt = rng.permuted(np.tile(outcomes, (replications, 1)), axis=-1)
        again = np.zeros((replications, *expected.shape), dtype=np.int64)
        np.add.at(again, (np.arange(replications)[:, None], batch[None, :], dealt), 1)
        observed[0, r] = _difference(flat[:, r], expected)
        replicated[:, r] = _difference(again, expected)
    return PredictiveCheck(
        observed.reshape(1, *size),
        replicated.reshape(replications, *size),
        ((trials > 0).sum(axis=0) > 1).reshape(size),
    )


def holm(p: ArrayLike) -> FloatArray:
    """Holm's p: below u for any true hypothesis with probability u at most; NaN are left out."""
    given = np.asarray(p, dtype=np.float64)
    flat, found = given.ravel(), np.full(given.size, np.nan)
    order = np.argsort(flat)[: int(np.isfinite(flat).sum())]
    steps = flat[order] * np.arange(len(order), 0, -1)
    found[order] = np.minimum(1.0, np.maximum.accumulate(steps))
    return found.reshape(given.shape)


def halves(counts: IntArray, rng: np.random.Generator) -> IntArray:
    """Counts whose order is not known, in two batches as a random order would have them.

    What is drawn is exchangeable, so that drift cannot be seen in it.

    counts: shape [...row, x_f]; the result is [batch, ...row, x_f].
    """
    first = np.zeros_like(counts)
    for at in np.ndindex(counts.shape[:-1]):
        first[at] = rng.multivariate_hypergeometric(counts[at], int(counts[at].sum()) // 2)
    return np.stack([first, counts - first])


def _p(observed: FloatArray, replicated: FloatArray) -> FloatArray:
    least = observed - EQUAL * (1.0 + np.abs(observed))
    return np.asarray((1 + (replicated >= least).sum(axis=0)) / (1 + len(replicated)))


def _checked(batches: IntArray, prior: ArrayLike) -> tuple[IntArray, FloatArray]:
    counts = np.asarray(batches)
    if counts.ndim < 2 or not np.issubdtype(counts.dtype, np.integer):
        raise ValueError(
            f'Expected whole counts of shape [batch, ..., x_f], got {counts.dtype} of shape '
            f'{counts.shape}.'
        )
    table('counts', counts.astype(np.float64), counts.shape)
    alpha = np.broadcast_to(np.asarray(prior, dtype=np.float64), counts.shape[1:])
    if not (alpha > 0).all():
        raise ValueError(f'Expected pseudo-counts above 0, got {alpha.min():g}.')
    return counts, alpha


def _in_parts(
    part: Callable[[int], tuple[FloatArray, FloatArray]],
    batches: IntArray,
    replications: int,
    tested: BoolArray,
) -> PredictiveCheck:
    """The discrepancies of all replications, made in parts that fit into memory."""
    size = max(1, min(replications, PART // batches.size))
    sizes = [min(size, replications - done) for done in range(0, replications, size)]
    made = [part(n) for n in sizes]
    one = len(made[0][0]) == 1 < sizes[0]
    observed = made[0][0] if one else np.concatenate([each[0] for each in made])
    return PredictiveCheck(observed, np.concatenate([each[1] for each in made]), tested)


def _dirichlet(alpha: FloatArray, rng: np.random.Generator) -> FloatArray:
    """One distribution from each Dirichlet(alpha), shape as of alpha."""
    gamma = rng.standard_gamma(alpha)
    # Of tiny pseudo-counts all may underflow; then the greatest has all.
    lost = gamma.sum(axis=-1, keepdims=True) == 0
    gamma = np.where(lost, alpha == alpha.max(axis=-1, keepdims=True), gamma)
    return np.asarray(gamma / gamma.sum(axis=-1, keepdims=True))


def _surprise(n: IntArray, alpha: FloatArray) -> FloatArray:
    """-log p(n) by the Dirichlet multinomial, nats, shape [...row]."""
    # Here, as nodes need no checks.
    from scipy.special import gammaln

    trials, total = n.sum(axis=-1), alpha.sum(axis=-1)
    whole = gammaln(trials + 1) + gammaln(total) - gammaln(trials + total)
    each = gammaln(n + alpha) - gammaln(alpha) - gammaln(n + 1)
    return np.asarray(-(whole + each.sum(axis=-1)))


def _difference(n: IntArray, expected: FloatArray) -> FloatArray:
    """Sum of n log(n / expected) over batches and final states, the last two axes."""
    share = np.divide(n, expected, out=np.ones(n.shape), where=(n > 0) & (expected > 0))
    return np.asarray((n * np.log(share)).sum(axis=(-1, -2)))

"""p(X_f | X_i, A), learned from the counts of the robot's own trials (Fig 3a, Fig 7)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from likeme_inference.tabletop.arrays import BoolArray, FloatArray, IntArray
from likeme_inference.tabletop.checks import number

#: Largest integer up to which all integers are exact as doubles.
MAX_COUNT = 2**53


def maximum_likelihood(counts: ArrayLike) -> FloatArray:
    """Relative frequencies: p(x_f | x_i, a) = counts[x_i, a, x_f] / sum over x_f.

    A row without trials is uniform, the mean of every symmetric Dirichlet prior.

    Args:
        counts: shape [..., x_f], 0 or more; trials, or trials and pseudo-counts.
    """
    counts = np.asarray(counts, dtype=np.float64)
    total = counts.sum(axis=-1, keepdims=True)
    uniform = np.full_like(counts, 1.0 / counts.shape[-1])
    transition: FloatArray = np.divide(counts, total, out=uniform, where=total > 0)
    return transition


@dataclass(frozen=True, eq=False)
class TransitionModel:
    """Trial counts of one object and the transition model that follows from them.

    Attributes:
        counts: number of trials in which (x_i, a) led to x_f; shape [x_i, a, x_f].
        prior: Dirichlet pseudo-counts: a scalar, or an array that broadcasts to the counts. 0 is
            the paper's maximum likelihood, dirichlet.CONCENTRATION is fitted to real trials.
    """

    counts: IntArray
    prior: float | FloatArray = 0.0

    def __post_init__(self) -> None:
        counts = np.array(self.counts)
        if counts.ndim != 3 or counts.shape[0] != counts.shape[2]:
            raise ValueError(f'Expected counts of shape [x_i, a, x_f], got {counts.shape}.')
        if not np.issubdtype(counts.dtype, np.integer) or counts.min(initial=0) < 0:
            raise ValueError(
                f'Expected whole counts of 0 or more, got {counts.dtype} down to {counts.min()}.'
            )
        if counts.sum(dtype=np.float64) > MAX_COUNT:
            raise ValueError(f'Expected at most 2^53 trials, got {counts.sum(dtype=np.float64)}.')
        prior = np.array(self.prior, dtype=np.float64)
        if not (prior >= 0).all() or prior.max(initial=0) > MAX_COUNT:
            raise ValueError(f'Expected pseudo-counts from 0 to 2^53, got {prior.tolist()}.')
        if not _broadcasts(prior.shape, counts.shape):
            raise ValueError(
                f'Expected a prior that broadcasts to {counts.shape}, got {prior.shape}.'
            )
        # Copies, so that callers cannot change the model.
        for name, array in (('counts', counts.astype(np.int64)), ('prior', prior)):
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    @classmethod
    def untried(
        cls, states: int, actions: int, prior: float | FloatArray = 0.0
    ) -> TransitionModel:
        """A model without trials."""
        return cls(np.zeros((states, actions, states), dtype=np.int64), prior)

    @cached_property
    def transition(self) -> FloatArray:
        """p(X_f | X_i, A), shape [x_i, a, x_f], read-only; rows without trials are uniform.

        (counts + prior) / sum over x_f: maximum likelihood for prior 0, else the mean of the
        Dirichlet posterior.
        """
        transition = maximum_likelihood(self.pseudo_counts)
        transition.flags.writeable = False
        return transition

    @property
    def pseudo_counts(self) -> FloatArray:
        """Parameters of the Dirichlet posterior, counts + prior, shape [x_i, a, x_f]."""
        return np.asarray(self.counts + np.asarray(self.prior, dtype=np.float64))

    @property
    def tried(self) -> BoolArray:
        """Whether action a has trials in state x_i, shape [x_i, a]."""
        return np.asarray(self.counts.sum(axis=-1) > 0)

    @property
    def trials(self) -> int:
        """Number of trials."""
        return int(self.counts.sum())

    def add(self, x_i: int, a: int, x_f: int, times: int = 1) -> TransitionModel:
        """The model with `times` more trials in which a moved the object from x_i to x_f.

        Raises:
            ValueError: an unknown state or action, or less than one trial.
        """
        states, actions, _ = self.counts.shape
        at = number('x_i', x_i, states), number('a', a, actions), number('x_f', x_f, states)
        if not isinstance(times, (int, np.integer)) or times < 1:
            raise ValueError(f'Expected at least 1 trial, got {times}.')
        counts = self.counts.copy()
        counts[at] += times
        return TransitionModel(counts, self.prior)

    def merge(self, other: TransitionModel) -> TransitionModel:
        """The model of both models' trials; the prior is not added twice.

        Raises:
            ValueError: another shape or another prior.
        """
        if other.counts.shape != self.counts.shape:
            raise ValueError(
                f'Expected counts of shape {self.counts.shape}, got {other.counts.shape}.'
            )
        if not np.array_equal(other.prior, self.prior):
            raise ValueError(f'Expected the prior {self.prior}, got {other.prior}.')
        return TransitionModel(self.counts + other.counts, self.prior)


def _broadcasts(shape: tuple[int, ...], to: tuple[int, ...]) -> bool:
    ends = zip(shape[::-1], to[::-1], strict=False)
    return len(shape) <= len(to) and all(n in (1, m) for n, m in ends)

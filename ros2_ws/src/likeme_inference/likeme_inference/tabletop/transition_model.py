"""p(X_f | X_i, A), learned by counting what the robot's own trials led to (Fig 3a, Fig 7)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]


def maximum_likelihood(counts: ArrayLike) -> FloatArray:
    """Relative frequencies: p(x_f | x_i, a) = counts[x_i, a, x_f] / sum over x_f.

    A row that was never tried is uniform, never NaN: no final state is preferred where nothing is
    known, which is also the mean of every symmetric Dirichlet before the first trial.

    Args:
        counts: shape [..., x_f], not negative.
    """
    counts = np.asarray(counts, dtype=np.float64)
    total = counts.sum(axis=-1, keepdims=True)
    uniform = np.full_like(counts, 1.0 / counts.shape[-1])
    transition: FloatArray = np.divide(counts, total, out=uniform, where=total > 0)
    return transition


@dataclass(frozen=True, eq=False)
class TransitionModel:
    """What the actions do to one object.

    Attributes:
        counts: how often (x_i, a) led to x_f; shape [x_i, a, x_f], of any size.
    """

    counts: IntArray

    def __post_init__(self) -> None:
        counts = np.array(self.counts)
        if counts.ndim != 3 or counts.shape[0] != counts.shape[2]:
            raise ValueError(f'Expected counts of shape [x_i, a, x_f], got {counts.shape}.')
        if not np.issubdtype(counts.dtype, np.integer) or counts.min(initial=0) < 0:
            raise ValueError(
                f'Expected whole counts of 0 or more, got {counts.dtype} down to {counts.min()}.'
            )
        counts = counts.astype(np.int64)
        counts.flags.writeable = False
        object.__setattr__(self, 'counts', counts)

    @cached_property
    def transition(self) -> FloatArray:
        """p(X_f | X_i, A), shape [x_i, a, x_f], read-only; rows never tried are uniform."""
        transition = maximum_likelihood(self.counts)
        transition.flags.writeable = False
        return transition

    @property
    def tried(self) -> BoolArray:
        """Whether action a was ever tried in state x_i, shape [x_i, a]."""
        return np.asarray(self.counts.sum(axis=-1) > 0)

    @property
    def trials(self) -> int:
        """How many trials the model was learned from."""
        return int(self.counts.sum())

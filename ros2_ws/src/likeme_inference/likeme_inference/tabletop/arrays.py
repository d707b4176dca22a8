"""The arrays of the discrete model, and a draw from one."""

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]


def drawn(weights: FloatArray, rng: np.random.Generator) -> int:
    """A position, drawn with a probability in proportion to its weight, shape [position]."""
    total = np.cumsum(weights)
    place = np.searchsorted(total, rng.random() * total[-1], side='right')
    return int(place.clip(max=len(total) - 1))

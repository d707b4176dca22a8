"""Evidence on a state: known, or soft; for one demonstration or many.

Integers are known states, of any shape; floats are distributions over states along the last axis,
as perception estimates them. A distribution enters as virtual evidence with likelihood p(x) under
a uniform prior. Known and soft evidence broadcast against each other.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from likeme_inference.tabletop.arrays import FloatArray
from likeme_inference.tabletop.checks import numbers

Evidence = NDArray[Any]


def evidence(what: str, seen: ArrayLike, states: int) -> Evidence:
    """Evidence as an array: of integers if known, else of float64.

    Raises:
        ValueError: an unknown state, a distribution over another number of states, or values that
            are negative or not finite.
    """
    array = np.asarray(seen)
    if array.dtype.kind != 'f':
        return numbers(what, array, states)
    if array.shape[-1:] != (states,):
        raise ValueError(
            f'Expected {what} as whole numbers or as distributions over {states} states, '
            f'got {array.dtype} of shape {array.shape}.'
        )
    wrong = ~((array >= 0) & np.isfinite(array))
    if wrong.any():
        raise ValueError(
            f'Expected {what} in probabilities of 0 or more, got {array[wrong].flat[0]}.'
        )
    return array.astype(np.float64, copy=False)


def known(seen: Evidence) -> bool:
    """Whether evidence is known states rather than distributions."""
    return seen.dtype.kind in 'iu'


def weighed(table: FloatArray, here: Evidence, there: Evidence) -> FloatArray:
    """Sum table[x_i, x_f, k] over both states, weighted by the evidence; shape [..., k]."""
    if known(here) and known(there):
        return np.asarray(table[here, there])
    if known(here):
        return np.asarray(np.einsum('...f,...fk->...k', there, table[here]))
    if known(there):
        rows = np.swapaxes(table, 0, 1)[there]
        return np.asarray(np.einsum('...x,...xk->...k', here, rows))
    states = len(table)
    joint = here[..., :, None] * there[..., None, :]
    flat = joint.reshape(*joint.shape[:-2], states * states)
    return np.asarray(flat @ table.reshape(states * states, -1))

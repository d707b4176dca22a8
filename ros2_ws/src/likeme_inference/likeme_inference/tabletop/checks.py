"""Validation of the model's arguments; errors state the expected and the received value."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from likeme_inference.tabletop.arrays import FloatArray, IntArray

#: Tolerance of sums of probabilities, for values that were single precision.
SUM_TOLERANCE = 1e-6


def number(what: str, value: Any, size: int) -> int:
    """The number of one state, action or goal of `size`.

    Raises:
        ValueError: any other value. NumPy would accept negative indices and True.
    """
    whole = isinstance(value, (int, np.integer)) and not isinstance(value, bool)
    if not whole or not 0 <= value < size:
        raise ValueError(f'Expected {what} from 0 to {size - 1}, got {value}.')
    return int(value)


def numbers(what: str, values: ArrayLike, size: int) -> IntArray:
    """Numbers of states, actions or goals, of any shape.

    Raises:
        ValueError: one of them is out of range.
    """
    array = np.asarray(values)
    if array.ndim == 0:
        return np.asarray(number(what, array[()], size))
    if array.size and array.dtype.kind not in 'iu':
        raise ValueError(f'Expected {what} in whole numbers, got {array.dtype}.')
    for extreme in (array.min(initial=0), array.max(initial=0)) if array.size else ():
        number(what, extreme, size)
    return array.astype(np.int64, copy=False)


def table(what: str, array: FloatArray, shape: tuple[int, ...]) -> None:
    """Check a table of probabilities or weights.

    Raises:
        ValueError: a wrong shape, an empty table, or values that are negative or not finite.
    """
    if array.shape != shape:
        raise ValueError(f'Expected {what} of shape {shape}, got {array.shape}.')
    if not array.size:
        raise ValueError(f'Expected {what} of at least one of each, got shape {shape}.')
    wrong = ~((array >= 0) & np.isfinite(array))
    if wrong.any():
        raise ValueError(f'Expected {what} of 0 or more, got {array[wrong].flat[0]}.')


def sums_to_one(what: str, array: FloatArray) -> None:
    """Check that distributions along the last axis sum to 1.

    Raises:
        ValueError: a sum that is not 1.
    """
    total = array.sum(axis=-1)
    wrong = ~(np.abs(total - 1.0) <= SUM_TOLERANCE)
    if wrong.any():
        raise ValueError(f'Expected {what} to sum to 1, got {total[wrong].flat[0]:g}.')

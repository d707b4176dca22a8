"""What the model refuses, each with a sentence of what was expected and what came."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from likeme_inference.tabletop.arrays import FloatArray, IntArray

#: How far a sum of probabilities may be from 1, for numbers that were single precision once.
SUM = 1e-6


def number(what: str, value: Any, size: int) -> int:
    """The number of one state, action or goal of `size`.

    Raises:
        ValueError: it is none. NumPy would count from the end, or take True for a mask.
    """
    whole = isinstance(value, (int, np.integer)) and not isinstance(value, bool)
    if not whole or not 0 <= value < size:
        raise ValueError(f'Expected {what} from 0 to {size - 1}, got {value}.')
    return int(value)


def numbers(what: str, values: ArrayLike, size: int) -> IntArray:
    """Numbers of states, actions or goals, of any shape.

    Raises:
        ValueError: one of them is none.
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
    """Refuse what is no table of probabilities or weights of this shape.

    Raises:
        ValueError: another shape, nothing in it, or a number that is not 0 or more and finite.
    """
    if array.shape != shape:
        raise ValueError(f'Expected {what} of shape {shape}, got {array.shape}.')
    if not array.size:
        raise ValueError(f'Expected {what} of at least one of each, got shape {shape}.')
    wrong = ~((array >= 0) & np.isfinite(array))
    if wrong.any():
        raise ValueError(f'Expected {what} of 0 or more, got {array[wrong].flat[0]}.')


def sums_to_one(what: str, array: FloatArray) -> None:
    """Refuse distributions along the last axis that are none.

    Raises:
        ValueError: a sum that is not 1.
    """
    total = array.sum(axis=-1)
    wrong = ~(np.abs(total - 1.0) <= SUM)
    if wrong.any():
        raise ValueError(f'Expected {what} to sum to 1, got {total[wrong].flat[0]:g}.')

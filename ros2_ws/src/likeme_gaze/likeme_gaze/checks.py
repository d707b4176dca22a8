"""What comes in from outside is looked at once, and refused with the two numbers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]

#: How far a covariance may be from symmetric, and its correlations from positive semidefinite,
#: and still be taken for one that was only rounded.
ROUNDING = 1e-9
VANISHED = 1e-60


def numbers(name: str, value: ArrayLike, shape: Sequence[int | None]) -> FloatArray:
    """`value` as a new float array of finite numbers; None in `shape` stands for any length.

    Raises:
        ValueError: another shape, or a number that is not finite.
    """
    try:
        array = np.array(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ValueError(f'Expected {name} to be numbers, got {value!r}.') from error
    fits = array.ndim == len(shape) and all(
        wanted in (None, got) for wanted, got in zip(shape, array.shape, strict=True)
    )
    if not fits:
        raise ValueError(f'Expected {name} of shape {_written(shape)}, got {array.shape}.')
    if not np.isfinite(array).all():
        worst = array[~np.isfinite(array)].flat[0]
        raise ValueError(f'Expected {name} to be finite, got {worst}.')
    return array


def covariances(name: str, value: ArrayLike, shape: Sequence[int]) -> FloatArray:
    """`value` as covariance matrices (..., D, D), made exactly symmetric.

    Raises:
        ValueError: another shape, not symmetric, or a variance or a correlation out of range.
    """
    array = numbers(name, value, shape)
    flipped = np.swapaxes(array, -1, -2)
    variances = np.diagonal(array, axis1=-2, axis2=-1)
    if (variances < 0).any():
        raise ValueError(f'Expected {name} with variances of at least 0, got {variances.min():g}.')
    scale = np.sqrt(variances)
    size = scale[..., :, None] * scale[..., None, :]
    # Entries this much smaller than the variances are what underflow left of a product.
    slack = VANISHED * variances.max(initial=0.0)
    if (np.abs(array - flipped) > ROUNDING * size + slack).any():
        gap = np.abs(array - flipped).max()
        raise ValueError(f'Expected {name} to be symmetric, got entries that differ by {gap:g}.')
    symmetric: FloatArray = (array + flipped) / 2
    correlation = np.divide(symmetric, size, out=np.zeros_like(array), where=size > 0)
    # An entry beyond its variances is refused all the same, without overflow on the way.
    np.clip(correlation, -1.5, 1.5, out=correlation)
    least = np.linalg.eigvalsh(correlation).min(initial=0.0)
    correlated = np.abs(symmetric[size == 0]).max(initial=0.0)
    if least < -ROUNDING * array.shape[-1] or correlated > slack:
        raise ValueError(
            f'Expected {name} to be positive semidefinite, got a correlation matrix with '
            f'eigenvalue {least:g}.'
        )
    return symmetric


def _written(shape: Sequence[int | None]) -> str:
    names = ['n' if length is None else str(length) for length in shape]
    return f'({", ".join(names)}{"," if len(names) == 1 else ""})'

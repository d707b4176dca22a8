"""Probabilities of an object's states from its centroid and the centroid's uncertainty."""

from __future__ import annotations

from itertools import pairwise
from math import erf, exp, pi, sqrt

import numpy as np

from likeme_core.geometry import Polygon, Rectangle
from likeme_core.regions import Regions
from likeme_core.tabletop import State
from likeme_perception.config import PerceptionConfig

#: p(state), indexed by the states' numbers; sums to 1.
Probability = tuple[float, ...]

#: On a table whose world is not known, an object is on it or not.
_ON_TABLE, _ELSEWHERE = State(0, 'ON_TABLE'), State(1, 'ELSEWHERE')
#: Beyond so many standard deviations a Gaussian is taken as 0 or 1.
_FAR = 8.0
#: Gauss-Legendre nodes and weights on [-1, 1], for the integral along a polygon's side.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(32)


def regions_of(config: PerceptionConfig, table: Rectangle) -> Regions:
    """The regions of the configured world; without one, the table itself is the only area."""
    if config.world is None:
        return Regions((_ON_TABLE, _ELSEWHERE), (table, None), config.fallen_depth)
    known = config.world.regions
    return Regions(known.states, known.areas, config.fallen_depth)


def state_probability(
    regions: Regions, centroid: tuple[float, float, float], sigma: float
) -> Probability:
    """p(state) of a centroid (m) with Gaussian noise sigma (m) in x and y.

    The probability mass of the Gaussian within each area; the rest is elsewhere.
    """
    x, y, z = centroid
    if z < -regions.fallen_depth:
        return certain(regions.elsewhere, regions)
    inside = [0.0 if area is None else _mass(area, x, y, sigma) for area in regions.areas]
    rest = 1.0
    for p in inside:
        rest -= p
    inside[regions.elsewhere] = max(0.0, rest)
    return tuple(inside)


def certain(state: State | None, regions: Regions) -> Probability:
    """1 for a known state; uniform if it is None."""
    if state is None:
        return (1 / len(regions.states),) * len(regions.states)
    return tuple(float(state == s) for s in regions.states)


def _mass(area: Rectangle | Polygon, x: float, y: float, sigma: float) -> float:
    """The probability that a point with this mean and noise lies in an area."""
    if isinstance(area, Rectangle):
        p_x = _between(area.x_min, area.x_max, x, sigma)
        return p_x * _between(area.y_min, area.y_max, y, sigma)
    corners = (area.corners() - (x, y)) / sigma
    total = sum(
        _below_side(start, end)
        for start, end in zip(corners, np.roll(corners, -1, 0), strict=True)
    )
    return min(1.0, abs(total))


def _below_side(start: np.ndarray, end: np.ndarray) -> float:
    """The standard normal's mass below a side, signed by its direction along x.

    Green's theorem: the signed sum over the sides of a polygon is the mass within it.
    """
    (x0, y0), (x1, y1) = map(tuple, (start, end))
    if x0 > x1:
        return -_below_side(end, start)
    # Split where the side enters and leaves the band in which Phi(y) is neither 0 nor 1.
    cuts = [0.0, 1.0]
    if y0 != y1:
        cuts += [float(np.clip((far - y0) / (y1 - y0), 0.0, 1.0)) for far in (-_FAR, _FAR)]
    if x0 != x1:
        cuts += [float(np.clip((far - x0) / (x1 - x0), 0.0, 1.0)) for far in (-_FAR, _FAR)]
    cuts.sort()
    return sum(_piece(x0, y0, x1, y1, a, b) for a, b in pairwise(cuts) if b > a)


def _piece(x0: float, y0: float, x1: float, y1: float, a: float, b: float) -> float:
    """The mass below the part of a side from the share a of its length to the share b."""
    middle_x, middle_y = ((p + (q - p) * (a + b) / 2) for p, q in ((x0, x1), (y0, y1)))
    if abs(middle_x) > _FAR or middle_y < -_FAR:
        return 0.0
    from_x, to_x = x0 + (x1 - x0) * a, x0 + (x1 - x0) * b
    if middle_y > _FAR:
        return _normal(to_x) - _normal(from_x)
    share = (a + b) / 2 + (b - a) / 2 * _NODES
    density = [exp(-0.5 * v * v) / sqrt(2 * pi) for v in x0 + (x1 - x0) * share]
    below = [_normal(v) for v in y0 + (y1 - y0) * share]
    return float(np.dot(_WEIGHTS, np.multiply(density, below)) * (to_x - from_x) / 2)


def _normal(value: float) -> float:
    return 0.5 * (1.0 + erf(value / sqrt(2.0)))


def _below(limit: float, mean: float, sigma: float) -> float:
    return 0.5 * (1.0 + erf((limit - mean) / (sigma * sqrt(2.0))))


def _between(low: float, high: float, mean: float, sigma: float) -> float:
    return max(0.0, _below(high, mean, sigma) - _below(low, mean, sigma))

"""Probabilities of the states of an object, by its centroid and the centroid's deviation."""

from __future__ import annotations

from math import erf, sqrt

from likeme_core.geometry import Rectangle
from likeme_core.regions import Regions
from likeme_core.tabletop import State
from likeme_perception.config import PerceptionConfig

Probability = tuple[float, float, float]

UNIFORM: Probability = (1 / 3, 1 / 3, 1 / 3)


def regions_of(config: PerceptionConfig, table: Rectangle) -> Regions:
    """The configured regions; without a work area the whole table counts."""
    return Regions(config.work_area or table, config.blue_line_y, config.fallen_depth)


def state_probability(
    regions: Regions, centroid: tuple[float, float, float], sigma: float
) -> Probability:
    """p(LEFT), p(RIGHT), p(OFFTABLE) for a centroid (m) with deviation sigma (m) in x and y.

    p(LEFT) = p(x inside) p(blue line < y < y_max), and so on; sums to 1.
    """
    x, y, z = centroid
    if z < -regions.fallen_depth:
        return 0.0, 0.0, 1.0
    area = regions.work_area
    line = min(max(regions.blue_line_y, area.y_min), area.y_max)
    p_x = _between(area.x_min, area.x_max, x, sigma)
    left = p_x * _between(line, area.y_max, y, sigma)
    right = p_x * _between(area.y_min, line, y, sigma)
    return left, right, max(0.0, 1.0 - left - right)


def certain(state: State | None) -> Probability:
    """The probability of a state that is known; uniform for one that is not."""
    if state is None:
        return UNIFORM
    left, right, off = (float(state is s) for s in State)
    return left, right, off


def _below(limit: float, mean: float, sigma: float) -> float:
    return 0.5 * (1.0 + erf((limit - mean) / (sigma * sqrt(2.0))))


def _between(low: float, high: float, mean: float, sigma: float) -> float:
    return max(0.0, _below(high, mean, sigma) - _below(low, mean, sigma))

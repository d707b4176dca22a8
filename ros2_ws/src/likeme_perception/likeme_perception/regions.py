"""The states of the paper and the centroid rule for them (section "Sensing")."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from math import erf, sqrt

from likeme_perception.config import PerceptionConfig, Rectangle

Probability = tuple[float, float, float]

UNIFORM: Probability = (1 / 3, 1 / 3, 1 / 3)


class State(IntEnum):
    """Where an object is; the numbers of likeme_msgs/ObjectState."""

    LEFT = 0
    RIGHT = 1
    OFFTABLE = 2
    UNKNOWN = 3


@dataclass(frozen=True)
class Regions:
    """The work area, split by the blue line: LEFT is y > blue_line_y.

    fallen_depth: a centroid this far below the table (m) is OFFTABLE wherever it is.
    """

    work_area: Rectangle
    blue_line_y: float
    fallen_depth: float = 0.03

    def state_of(self, x: float, y: float, z: float = 0.0) -> State:
        """The centroid rule, positions in m."""
        area = self.work_area
        inside = area.x_min <= x <= area.x_max and area.y_min <= y <= area.y_max
        if z < -self.fallen_depth or not inside:
            return State.OFFTABLE
        return State.LEFT if y > self.blue_line_y else State.RIGHT

    def probability(self, x: float, y: float, z: float, sigma: float) -> Probability:
        """p(LEFT), p(RIGHT), p(OFFTABLE) for a centroid with deviation sigma (m) in x and y.

        p(LEFT) = p(x inside) p(blue line < y < y_max), and so on; sums to 1.
        """
        if z < -self.fallen_depth:
            return 0.0, 0.0, 1.0
        area, line = (
            self.work_area,
            min(max(self.blue_line_y, self.work_area.y_min), self.work_area.y_max),
        )
        p_x = _between(area.x_min, area.x_max, x, sigma)
        left = p_x * _between(line, area.y_max, y, sigma)
        right = p_x * _between(area.y_min, line, y, sigma)
        return left, right, max(0.0, 1.0 - left - right)


def regions_of(config: PerceptionConfig, table: Rectangle) -> Regions:
    """The configured regions; without a work area the whole table counts."""
    return Regions(config.work_area or table, config.blue_line_y, config.fallen_depth)


def certain(state: State) -> Probability:
    """The probability of a state that is known; uniform for UNKNOWN."""
    if state is State.UNKNOWN:
        return UNIFORM
    left, right, off = (float(state is s) for s in (State.LEFT, State.RIGHT, State.OFFTABLE))
    return left, right, off


def _below(limit: float, mean: float, sigma: float) -> float:
    return 0.5 * (1.0 + erf((limit - mean) / (sigma * sqrt(2.0))))


def _between(low: float, high: float, mean: float, sigma: float) -> float:
    return max(0.0, _below(high, mean, sigma) - _below(low, mean, sigma))

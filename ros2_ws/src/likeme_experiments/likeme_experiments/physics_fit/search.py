"""Coordinate search with common random numbers, one parameter after another.

Every level of a parameter is tried with the same seeds, and only on the rows that it can affect.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise

from likeme_arm_sim.fitted_parameters import fitted_parameters
from likeme_core.paper_world import OFFTABLE, WORLD
from likeme_core.tabletop import Manner
from likeme_experiments.physics_fit.deviance import deviance
from likeme_experiments.physics_fit.table_rows import TableRow

Counts = tuple[int, ...]
# Parameters in the order of the search, the most influential first; then some again, with smaller
# steps.
WIDE = (
    'place_share', 'pear_mass', 'chicken_mass', 'lemon_mass', 'push_off_heading', 'reach',
    'push_gap', 'pear_rolling', 'lemon_rolling', 'arm_skew', 'release_height',
)  # fmt: skip
NEAR = ('pear_mass', 'lemon_friction', 'chicken_friction', 'pear_friction', 'reach')
# Steps from the current value, in shares of the searched range.
AWAY, NEARER = (-0.3, -0.15, 0.0, 0.15, 0.3), (-0.1, 0.0, 0.1)
STEPS = (*((name, AWAY) for name in WIDE), *((name, NEARER) for name in NEAR))
# A level replaces the current value only if it is better by this much.
MARGIN = 1.0
# Parameters by the rows they affect: places or pushes, to LEFT and RIGHT or OFFTABLE.
GRASPING = {'grip_force', 'grasp_height'}
PLACING_ACROSS = {'place_share', 'release_height', 'bounce'}
# A rotated calibration moves a grasp by millimetres, but a push off the centre of a round toy.
PUSHING = {'push_gap', 'arm_skew'}
PUSHING_ACROSS = {'push_past'}
PUSHING_OFF = {'push_off_heading', 'reach'}


def touches(parameter: str, row: TableRow) -> bool:
    """Whether a parameter can noticeably change how a row ends."""
    first, _, rest = parameter.partition('_')
    if first in WORLD.objects:
        if first != row.name:
            return False
        # A heavier toy does not slide further when it is pushed: friction grows with its mass.
        parameter = 'grip_force' if rest == 'mass' else rest
    is_push, off = row.action.manner is Manner.PUSH, row.action.target == OFFTABLE
    if parameter in GRASPING:
        return not is_push
    if parameter in PLACING_ACROSS:
        return not is_push and not off
    if parameter in PUSHING:
        return is_push
    if parameter in PUSHING_ACROSS:
        return is_push and not off
    if parameter in PUSHING_OFF:
        return is_push and off
    return True


def levels(parameter: str, value: float, away: Sequence[float] = AWAY) -> list[float]:
    """The values to try, ascending and within the range; `value` is one of them."""
    p = fitted_parameters(WORLD)[parameter]
    around = {min(max(value + part * (p.high - p.low), p.low), p.high) for part in away}
    around.add(value)
    ordered = sorted(around)
    near = {b for a, b in pairwise(ordered) if b - a < 1e-9 * (p.high - p.low)} - {value}
    return [level for level in ordered if level not in near]


def best_level(
    value: float, tried: Mapping[float, Mapping[str, Counts]], touched: Sequence[TableRow]
) -> tuple[float, float, float]:
    """The next value, its deviance, and that of the current value, summed over the rows.

    Args:
        value: the current one; one of the levels.
        tried: counts by row name, by level.
        touched: the affected rows.
    """
    losses = {
        level: sum(deviance(row.real, counts[str(row)]) for row in touched)
        for level, counts in tried.items()
    }
    best = min(losses, key=lambda level: (losses[level], level))
    if losses[best] > losses[value] - MARGIN:
        best = value
    return best, losses[best], losses[value]

"""The region that an object was moved towards, also if it did not arrive there."""

from __future__ import annotations

from collections.abc import Sequence
from math import atan2, cos, hypot, pi, sin

from likeme_core.regions import Regions
from likeme_core.tabletop import State

#: Share of the way to the border of its region that an object must have been moved before the
#: region behind the border is said to be the aim. Of what the simulated person moves within a
#: region, from and to places drawn as the world file says, 0.8 % of pushes and 4 % of places do.
LEAST_SHARE = 0.5
#: Half of the angle (rad) in which the heading is uncertain: the aim must be the same within it.
HALF_ANGLE = pi / 18
# Step (m) along a heading, and its greatest length.
_STEP, _FAR = 0.01, 3.0

Point = tuple[float, float, float]


def moved_towards(
    regions: Regions, start: State, path: Sequence[Point], lifted: bool, vanished: bool = False
) -> State | None:
    """The region that an object was moved towards; None if it cannot be told.

    A region that the object came into is the one that it was moved towards. What was carried was
    carried to that of its farthest place; of what slid through several it is not known which was
    meant. What has not left its region was moved towards the region straight ahead if it went
    LEAST_SHARE of the way to the border, else it may have been meant to stay.

    Args:
        regions: the world's.
        start: where it lay, in the first place of `path`.
        path: its places, m, the first at rest; of what was lifted those in the air.
        lifted: whether it was off the table.
        vanished: whether it slid elsewhere, out of sight.
    """
    x, y, _ = path[0]
    farthest = max(path, key=lambda p: hypot(p[0] - x, p[1] - y))
    last = regions.elsewhere if vanished else regions.state_of(*farthest)
    # Between two regions lies what is none: passing it is no aim.
    between = last == regions.elsewhere and regions.work_area.contains(*farthest[:2])
    if lifted and last != start:
        return None if between else last
    came_into = {last, *(regions.state_of(*place) for place in path)} - {start}
    came_into -= {regions.elsewhere} - {last}
    if len(came_into) > 1:
        return None
    if came_into:
        return came_into.pop()
    length = hypot(farthest[0] - x, farthest[1] - y)
    heading = atan2(farthest[1] - y, farthest[0] - x)
    ahead = {
        _ahead(regions, start, (x, y), heading + turn, length / LEAST_SHARE)
        for turn in (-HALF_ANGLE, 0.0, HALF_ANGLE)
    }
    return ahead.pop() if len(ahead) == 1 else None


def _ahead(
    regions: Regions, own: State, start: tuple[float, float], heading: float, reach: float
) -> State | None:
    """The region straight ahead, if that of the start ends within `reach`, m; else None."""
    table, left = regions.work_area, False
    for k in range(1, round(_FAR / _STEP)):
        if not left and k * _STEP > reach:
            return None
        x, y = start[0] + k * _STEP * cos(heading), start[1] + k * _STEP * sin(heading)
        state = regions.state_of(x, y)
        left = left or state != own
        if left and state != regions.elsewhere:
            return state if state != own else None
        if left and not table.contains(x, y):
            return regions.elsewhere if own != regions.elsewhere else None
    return None

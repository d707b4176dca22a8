"""Which parts of the table are free of the objects that the camera sees."""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite

import numpy as np
import shapely
from shapely import affinity

from likeme_arm.motion import ObjectView
from likeme_arm.tool_pose import ToolPose
from likeme_core.table import Table

#: A centroid further than this outside the table top is not that of an object on it, m.
TABLE_MARGIN = 0.05
#: Extent of an object that is not known, m.
UNKNOWN_EXTENT = 0.08
#: The Panda's hand, pointing down, around the grasp point, m: half its extents along its flat axis
#: and across, and its lower side; half a finger along that axis, its depth across it, and its tip.
HALF_THICKNESS, HALF_HAND, HAND_BOTTOM = 0.032, 0.104, 0.039
HALF_FINGER, FINGER_DEPTH, TIP = 0.011, 0.027, -0.008
#: By how much the hand's outline may lie over that of an object, m: what is hardly higher than its
#: lower side is narrower there.
HAND_OVERLAP = 0.02
#: By how much a perceived height may be too small, m.
HEIGHT_MARGIN = 0.005


class FreeSpace:
    """Outlines and heights of the other objects on a table."""

    def __init__(self, table: Table, others: Mapping[str, ObjectView]) -> None:
        """others: all that was seen but the object that is acted on, by name."""
        self._outlines = {
            name: (outline(view), view.height or UNKNOWN_EXTENT)
            for name, view in others.items()
            if on_table(table, view)
        }

    @property
    def empty(self) -> bool:
        """Whether nothing else is on the table."""
        return not self._outlines

    def blocker(self, footprint: shapely.Geometry, above: float = 0.0) -> str | None:
        """The first object in a footprint that is higher than `above` (m); None: it is free."""
        return next(
            (
                name
                for name, (shape, height) in self._outlines.items()
                if height + HEIGHT_MARGIN > above and shape.intersects(footprint)
            ),
            None,
        )

    def gripper_blocker(
        self, start: ToolPose, end: ToolPose, opening: float, clearance: float
    ) -> str | None:
        """What the gripper would touch on a line, hand down, `opening` m between its fingers."""
        low = min(start.z, end.z)
        half = opening / 2 + FINGER_DEPTH
        fingers = _swept(start, end, HALF_FINGER + clearance, half + clearance)
        over = clearance - HAND_OVERLAP
        hand = _swept(start, end, HALF_THICKNESS + over, HALF_HAND + over)
        return self.blocker(fingers, low + TIP) or self.blocker(hand, low + HAND_BOTTOM)


def on_table(table: Table, view: ObjectView) -> bool:
    """Whether an object lies on the table, not below it."""
    return bool(table.top.contains(view.x, view.y, TABLE_MARGIN)) and not view.height < 0.0


def outline(view: ObjectView) -> shapely.Polygon:
    """What an object covers of the table: a rectangle along its major axis, m."""
    length, width = view.length or UNKNOWN_EXTENT, view.width or UNKNOWN_EXTENT
    turn = view.yaw if isfinite(view.yaw) else 0.0
    return _rectangle(view.x, view.y, turn, length / 2, width / 2)


def _swept(start: ToolPose, end: ToolPose, along: float, across: float) -> shapely.Geometry:
    """What a rectangle covers on a line without a turn."""
    ends = [_rectangle(pose.x, pose.y, start.yaw, along, across) for pose in (start, end)]
    return shapely.union_all(ends).convex_hull


def _rectangle(x: float, y: float, yaw: float, along: float, across: float) -> shapely.Polygon:
    turned = affinity.rotate(shapely.box(-along, -across, along, across), yaw, (0, 0), True)
    return affinity.translate(turned, x, y)


def radius(view: ObjectView) -> float:
    """Half of an object's diagonal seen from above, m."""
    return float(np.hypot(view.length or UNKNOWN_EXTENT, view.width or UNKNOWN_EXTENT)) / 2


def least_radius(view: ObjectView) -> float:
    """Half of an object's smaller extent seen from above, m; 0: not known."""
    return min(view.length, view.width) / 2

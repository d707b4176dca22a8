"""What the still scene tells of a frame: whether it was read, and whether the camera moved."""

from __future__ import annotations

from collections import Counter
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from likeme_core.stamps import nanoseconds
from likeme_perception.background import ON_PLANE, Background
from likeme_perception.edge_alignment import EdgeAlignment, colour_edges, depth_edges
from likeme_perception.rgbd import RgbdFrame

Index = NDArray[np.intp]

# Least number of pixels of the bare table for a verdict.
_LEAST = 50
# Every so manieth of them is enough for light and holes; the edges need more.
_COARSER = 5
# Least share of them with a reading: with less, objects are no longer found (bench.sh eyes).
_LEAST_READ = 0.4
# s between two looks at plane and edges; so many deviating ones in a row are a moved camera.
_PERIOD, _TIMES = 0.25, 3
# Greatest tilt (rad) and distance (m) of the table's plane; their noise is 0.06 degrees and 1 mm.
_TILT, _LIFT = float(np.radians(0.5)), 0.01
# Depth (m) below the table at which a pixel sees past it, and the greatest share of such pixels;
# at rest it is 0.
_PAST, _PAST_SHARE = 0.04, 0.005
# Least share of readings on the found plane: with less, something covers the table.
_LEAST_ON_PLANE = 0.3

#: Reasons why a frame tells nothing.
CAMERA_MOVED, DEPTH_MISSING = 'camera moved', 'depth missing'
NOT_REGISTERED = 'depth does not fit the colours'


class TableCheck:
    """Checks frames against the background that was learned before them.

    Attributes:
        moved: whether the camera has moved since; it stays so.
    """

    def __init__(self, background: Background) -> None:
        self._view = background.view
        self._pixels = background.bare_pixels
        self._some = self._pixels[::_COARSER]
        self._slope = self._view.slope.take(self._some)
        self._colours = EdgeAlignment(colour_edges(background.colour), background.still)
        self._depths = EdgeAlignment(depth_edges(background.depth), background.still)
        self._looked = 0
        self._deviating: Counter[str] = Counter()
        self.moved = False

    @property
    def pixels(self) -> Index:
        """Pixels that showed the bare table when the background was learned, flat indices."""
        return self._some

    @cached_property
    def enough(self) -> bool:
        """Whether enough of the table was bare to judge by it."""
        return len(self._some) >= _LEAST

    def bare_now(self, frame: RgbdFrame) -> Index:
        """Those of them that nothing covers now; all, if there are too few to tell."""
        height = frame.depth.take(self._some) * self._slope + self._view.origin[2]
        bare = self._some[np.abs(height) < ON_PLANE]
        return bare if len(bare) >= _LEAST else self._some

    def unread(self, frame: RgbdFrame) -> bool:
        """Whether too little of the table has a depth reading."""
        read = np.isfinite(frame.depth.take(self._some))
        return self.enough and float(read.mean()) < _LEAST_READ

    def misfit(self, frame: RgbdFrame, lit: bool = True) -> str:
        """Why a frame does not fit the background; empty if it does.

        lit: whether its colours can be told. That the camera moved stays so once it was seen.
        Where the depth alone has shifted it is not registered to the colours.
        """
        if self.moved:
            return CAMERA_MOVED
        # Stamps may go back.
        if abs(frame.stamp - self._looked) >= nanoseconds(_PERIOD):
            self._looked = frame.stamp
            self._look(frame, lit)
        self.moved = self._deviating[CAMERA_MOVED] >= _TIMES
        if self.moved:
            return CAMERA_MOVED
        return NOT_REGISTERED if self._deviating[NOT_REGISTERED] >= _TIMES else ''

    def _look(self, frame: RgbdFrame, lit: bool) -> None:
        """Count in how many looks in a row it deviates in the same way."""
        found = ''
        if (lit and self._colours.moved(colour_edges(frame.rgb))) or (
            self.enough and self._deviates(frame)
        ):
            found = CAMERA_MOVED
        elif self._depths.moved(depth_edges(frame.depth)):
            found = NOT_REGISTERED if lit and self._colours.distinct else CAMERA_MOVED
        for reason in CAMERA_MOVED, NOT_REGISTERED:
            self._deviating[reason] = self._deviating[reason] + 1 if reason == found else 0

    def _deviates(self, frame: RgbdFrame) -> bool:
        depth = frame.depth.take(self._pixels)
        read = np.isfinite(depth)
        if read.mean() < _LEAST_READ:
            return False
        points = self._view.points(self._pixels[read], depth[read])
        if float(np.mean(points[:, 2] < -_PAST)) > _PAST_SHARE:
            return True
        slope_x, slope_y, height, share = _level(points)
        tilt = float(np.arctan(np.hypot(slope_x, slope_y)))
        return share > _LEAST_ON_PLANE and (tilt > _TILT or abs(height) > _LIFT)


def _level(points: NDArray[np.float32]) -> tuple[float, float, float, float]:
    """The plane z = a x + b y + c with most of the points (N, 3): a, b, z at their mean, share.

    Sampled triples, then least squares on what lies on the best of them.
    """
    rng = np.random.default_rng(0)
    x, y, z = np.asarray(points, np.float64).T
    ones = np.ones(len(points))
    design = np.stack([x - x.mean(), y - y.mean(), ones], axis=1)
    some = rng.integers(len(points), size=min(len(points), 400))
    triples = rng.integers(len(points), size=(40, 3))
    regular = np.abs(np.linalg.det(design[triples])) > 1e-4
    if not regular.any():
        return 0.0, 0.0, 0.0, 0.0
    planes = np.linalg.solve(design[triples[regular]], z[triples[regular]][..., None])[..., 0]
    counts = (np.abs(design[some] @ planes.T - z[some, None]) < ON_PLANE).sum(axis=0)
    plane = planes[counts.argmax()]
    for _ in range(2):
        on = np.abs(design @ plane - z) < ON_PLANE
        if on.sum() < _LEAST:
            return 0.0, 0.0, 0.0, 0.0
        plane = np.linalg.lstsq(design[on], z[on], rcond=None)[0]
    a, b, c = (float(v) for v in plane)
    return a, b, c, float(on.mean())

"""Hands and arms: what reaches in over the table's edge, told from the things it touches.

Depth finds them (something large that comes in from outside the table, or is too large for a
thing), the side they come in over says whose they are, and colour, learned on line from what was
seen of them, cuts the held thing from the hand.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from likeme_perception.background import Background
from likeme_perception.colour import LogDensity
from likeme_perception.config import PerceptionConfig
from likeme_perception.entry_side import nearest_side, sides_reached
from likeme_perception.hand_arm_colour import IntruderColour
from likeme_perception.hand_completion import grown_by_colour, unlike_background
from likeme_perception.hand_tip import HandTip, hand_tip
from likeme_perception.rgbd import RgbdFrame
from likeme_perception.segmentation import (
    Blob,
    Index,
    blobs_of,
    image_components,
    merged,
    rows_and_columns,
)

ImageB = NDArray[np.uint8]
ImageF = NDArray[np.float32]
Mask = NDArray[np.bool_]
Box = tuple[int, int, int, int]

# A hand or an arm rises at least this high (m) somewhere, and a part of one that the image cuts
# off shows at least so many pixels of its edge.
_RISEN = 0.03
_EDGE_PIXELS = 30
# A hand that is busy beside the table, this near (m), has not left it.
_BESIDE = 0.15
# A loose piece of a hand or an arm lies within its box or this many pixels beside it.
_LOOSE = 20
# How far (m) beside the table things are looked for in the pixels of a hand or an arm.
_SEARCHED = 0.25


@dataclass(frozen=True, eq=False)
class Intruders:
    """Pixels of hand and arm (flat indices), their area (m^2) over the table, and the rest.

    things: foreground that is neither hand nor arm.
    """

    hand: Index
    arm: Index
    hand_area: float
    arm_area: float
    tip: HandTip | None
    things: tuple[Blob, ...]


class IntruderSegmenter:
    """Finds hands and arms frame by frame, learning their colours as they come in."""

    def __init__(self, config: PerceptionConfig, catalogue: LogDensity | None) -> None:
        """catalogue: greatest log p(colour) of any known thing at each bin, None without any."""
        self._config = config
        self._before = {'hand': np.zeros(0, np.intp), 'arm': np.zeros(0, np.intp)}
        self._colours = {kind: IntruderColour(catalogue) for kind in self._before}

    def segment(
        self, frame: RgbdFrame, foreground: ImageB, background: Background, protected: ImageB
    ) -> Intruders:
        """Split the foreground into hand, arm and things.

        protected: pixels in which a resting thing was recognised unchanged, never hand or arm.
        """
        found: dict[str, list[Blob]] = {'hand': [], 'arm': []}
        rest: list[Blob] = []
        for blob in blobs_of(image_components(foreground), frame, background.view):
            kind = self._kind(blob, frame, background)
            if kind is None:
                rest.append(blob)
                continue
            thing = self._things_in(kind, blob, frame, background, protected)
            if thing.any():
                rest += blobs_of([blob.pixels[thing]], frame, background.view)
                blob = blob.part(~thing)
            found[kind].append(blob)
        boxes = {kind: _box(found[kind], frame.depth.shape[1]) for kind in found}
        things = [
            blob for blob in rest if not self._joins(blob, found, boxes, frame.depth.shape[1])
        ]
        return self._result(found, things, frame, background, foreground)

    def _kind(self, blob: Blob, frame: RgbdFrame, background: Background) -> str | None:
        """'hand', 'arm' or, for a thing, None."""
        c, table = self._config, background.area
        sides = c.human_sides + c.robot_sides
        area = background.view.pixel_area(frame.depth.take(blob.pixels))
        reached = sides_reached(blob.xyz, area, table, -c.fallen_depth, sides)
        if not reached and sides and self._too_large(blob, frame.depth.shape):
            reached = frozenset([nearest_side(blob.xyz, table, sides)])
        kinds = [
            k for k, own in (('arm', c.robot_sides), ('hand', c.human_sides)) if reached & set(own)
        ]
        if len(kinds) < 2:
            return kinds[0] if kinds else None
        # Something spans the table: what it was in the frame before, it still is.
        overlap = {
            k: np.isin(blob.pixels, self._before[k], assume_unique=True).sum() for k in kinds
        }
        return max(kinds, key=lambda k: overlap[k])

    def _too_large(self, blob: Blob, shape: tuple[int, ...]) -> bool:
        """Whether a blob is larger than any thing, or large and cut off by the image's edge."""
        if blob.xyz[2].max() < _RISEN:
            return False
        c, size = self._config, blob.extent
        if size > c.max_object_length or not size > c.cut_off_length:
            return size > c.max_object_length
        rows, columns = rows_and_columns(blob.pixels, shape[1])
        edge = (rows < 2) | (columns < 2) | (rows >= shape[0] - 2) | (columns >= shape[1] - 2)
        return int(np.count_nonzero(edge)) > _EDGE_PIXELS

    def _things_in(
        self, kind: str, blob: Blob, frame: RgbdFrame, background: Background, protected: ImageB
    ) -> Mask:
        """Which pixels of an intruder are those of things in front of, under or in it."""
        thing = protected.take(blob.pixels) > 0
        own = np.flatnonzero(~thing)[::3]
        self._colours[kind].learn(
            blob.bins[own[unlike_background(frame, background, blob.pixels[own])]]
        )
        # Things are over the table or just beside it; the rest of a long arm need not be searched.
        x, y, _ = blob.xyz
        near = np.flatnonzero(background.area.contains(x, y, _SEARCHED))
        if len(near) == 0:
            return np.zeros_like(thing)
        thing[near] |= self._colours[kind].things_among(
            blob.pixels[near], blob.bins[near], frame.depth.shape[1]
        )
        return thing

    def _joins(
        self,
        blob: Blob,
        found: dict[str, list[Blob]],
        boxes: dict[str, Box | None],
        width: int,
    ) -> bool:
        """Whether a loose piece is a finger or a link that something in front cut off."""
        for kind, box in boxes.items():
            near = box is not None and _near(blob.pixels, box, width)
            if near and self._colours[kind].explains(blob.bins):
                found[kind].append(blob)
                return True
        return False

    def _result(
        self,
        found: dict[str, list[Blob]],
        things: list[Blob],
        frame: RgbdFrame,
        background: Background,
        foreground: ImageB,
    ) -> Intruders:
        hand, arm = merged(found['hand']), merged(found['arm'])
        self._before = {'hand': hand.pixels, 'arm': arm.pixels}
        colour = self._colours['hand'].log_density
        more = grown_by_colour(frame, background, hand.pixels, colour, foreground)
        return Intruders(
            np.concatenate([hand.pixels, more]),
            arm.pixels,
            _area_over_table(hand, frame.depth, background, _BESIDE),
            _area_over_table(arm, frame.depth, background),
            hand_tip(hand, background, self._config.human_sides),
            tuple(things),
        )


def _box(blobs: list[Blob], width: int) -> Box | None:
    """First and last row and column of some blobs with a margin for loose pieces."""
    pixels = merged(blobs).pixels
    # What reached in may have been cut away whole: all of it looked like the thing it holds.
    if len(pixels) == 0:
        return None
    rows, columns = rows_and_columns(pixels, width)
    return (
        int(rows.min()) - _LOOSE,
        int(rows.max()) + _LOOSE,
        int(columns.min()) - _LOOSE,
        int(columns.max()) + _LOOSE,
    )


def _near(pixels: Index, box: Box, width: int) -> bool:
    """Whether the middle of some pixels lies within a box."""
    row, column = (float(v.mean()) for v in rows_and_columns(pixels, width))
    return box[0] < row < box[1] and box[2] < column < box[3]


def _area_over_table(
    blob: Blob, depth: ImageF, background: Background, margin: float = 0.0
) -> float:
    """Surface (m^2) of the pixels that hide table or hang over it or its margin (m)."""
    x, y, _ = blob.xyz
    over = background.area.contains(x, y, margin) | background.table.take(blob.pixels)
    return float(background.view.pixel_area(depth.take(blob.pixels[over])).sum())

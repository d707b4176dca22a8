"""Segmentation of the foreground into person's hand, robot's arm and objects.

A hand or arm ("limb") is a blob that extends over the table's edge or is too large for an object.
The side over which it enters decides whether it is a hand or an arm; where it reaches over none,
what it was before does. Its colours, learned online, separate it from an object that it holds or
covers.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from likeme_perception.background import Background
from likeme_perception.blobs import (
    Blob,
    Index,
    blobs_of,
    image_components,
    merged,
    rows_and_columns,
)
from likeme_perception.colour import LogDensity
from likeme_perception.config import PerceptionConfig
from likeme_perception.entry_side import entry_sides, nearest_side
from likeme_perception.hand_arm_colour import HandArmColour
from likeme_perception.hand_completion import complete_by_colour, differs_from_background
from likeme_perception.hand_tip import HandTip, hand_tip
from likeme_perception.rgbd import RgbdFrame

ImageB = NDArray[np.uint8]
ImageF = NDArray[np.float32]
Mask = NDArray[np.bool_]
Box = tuple[int, int, int, int]

# Least height (m) of the highest point of a limb that is found by its size.
_LEAST_HEIGHT = 0.03
# Least number of pixels on the image border of a limb that the image cuts off.
_BORDER_PIXELS = 30
# A hand within this distance (m) of the table has not left it.
_HAND_MARGIN = 0.15
# Margin (pixels) of a limb's bounding box, within which separate parts of it are looked for.
_BOX_MARGIN = 20
# Distance (m) from the table up to which objects are looked for in the pixels of a limb.
_SEARCH_MARGIN = 0.25


@dataclass(frozen=True, eq=False)
class HandArmSegmentation:
    """Pixels of hand and arm (flat indices), their areas over the table (m^2), and the rest.

    tip: of the hand. objects: foreground blobs that are neither hand nor arm. detached: whether
    none of it reaches over the table's edge, so that size alone makes it a hand or an arm.
    """

    hand: Index
    arm: Index
    hand_area: float
    arm_area: float
    tip: HandTip | None
    objects: tuple[Blob, ...]
    detached: bool = False


class HandArmSegmenter:
    """Segments each frame and updates the colour models of hand and arm."""

    def __init__(self, config: PerceptionConfig, catalogue: LogDensity | None) -> None:
        """catalogue: greatest log p(colour) over the known objects at each bin; None without."""
        self._config = config
        self._previous = {'hand': np.zeros(0, np.intp), 'arm': np.zeros(0, np.intp)}
        self._catalogue = catalogue
        self._colours = {kind: HandArmColour(catalogue) for kind in self._previous}
        self._reaches_in = False

    def compare_with(self, catalogue: LogDensity | None) -> None:
        """Use other colours of the known objects from now on; catalogue: see __init__."""
        if catalogue is self._catalogue:
            return
        self._catalogue = catalogue
        for colour in self._colours.values():
            colour.compare_with(catalogue)

    def segment(
        self, frame: RgbdFrame, foreground: ImageB, background: Background, protected: ImageB
    ) -> HandArmSegmentation:
        """Split the foreground into hand, arm and objects.

        protected: pixels of objects at rest that have not changed; never hand or arm.
        """
        found: dict[str, list[Blob]] = {'hand': [], 'arm': []}
        rest: list[Blob] = []
        self._reaches_in = False
        for blob in blobs_of(image_components(foreground), frame, background.view):
            kind = self._kind(blob, frame, background)
            if kind is None:
                rest.append(blob)
                continue
            held = self._object_pixels(kind, blob, frame, background, protected)
            if held.any():
                rest += blobs_of([blob.pixels[held]], frame, background.view)
                blob = blob.part(~held)
            found[kind].append(blob)
        boxes = {kind: _box(found[kind], frame.depth.shape[1]) for kind in found}
        objects = [
            blob for blob in rest if not self._joins(blob, found, boxes, frame.depth.shape[1])
        ]
        return self._result(found, objects, frame, background, foreground)

    def _kind(self, blob: Blob, frame: RgbdFrame, background: Background) -> str | None:
        """'hand', 'arm' or, for an object, None."""
        c, table = self._config, background.area
        sides = c.human_sides + c.robot_sides
        area = background.view.pixel_area(frame.depth.take(blob.pixels))
        reached = entry_sides(blob.xyz, area, table, -c.fallen_depth, sides)
        self._reaches_in |= bool(reached)
        if not reached and sides and self._too_large(blob, frame.depth.shape):
            before = self._overlaps(blob)
            if max(before.values()) > len(blob.pixels) / 2:
                return max(before, key=lambda k: before[k])
            reached = frozenset([nearest_side(blob.xyz, table, sides)])
        kinds = [
            k for k, own in (('arm', c.robot_sides), ('hand', c.human_sides)) if reached & set(own)
        ]
        if len(kinds) < 2:
            return kinds[0] if kinds else None
        # It spans the table: it is what it overlaps most in the previous frame.
        overlap = self._overlaps(blob)
        return max(kinds, key=lambda k: overlap[k])

    def _overlaps(self, blob: Blob) -> dict[str, int]:
        """How many pixels of a blob were hand, and arm, in the previous frame."""
        return {
            k: int(np.isin(blob.pixels, before, assume_unique=True).sum())
            for k, before in self._previous.items()
        }

    def _too_large(self, blob: Blob, shape: tuple[int, ...]) -> bool:
        """Whether a blob is larger than any object, or large and cut off by the image border."""
        if blob.xyz[2].max() < _LEAST_HEIGHT:
            return False
        c, size = self._config, blob.extent
        if size > c.max_object_length or not size > c.cut_off_length:
            return size > c.max_object_length
        rows, columns = rows_and_columns(blob.pixels, shape[1])
        border = (rows < 2) | (columns < 2) | (rows >= shape[0] - 2) | (columns >= shape[1] - 2)
        return int(np.count_nonzero(border)) > _BORDER_PIXELS

    def _object_pixels(
        self, kind: str, blob: Blob, frame: RgbdFrame, background: Background, protected: ImageB
    ) -> Mask:
        """Mask of the limb's pixels that belong to objects in front of it, under it or held."""
        held = protected.take(blob.pixels) > 0
        own = np.flatnonzero(~held)[::3]
        self._colours[kind].learn(
            blob.bins[own[differs_from_background(frame, background, blob.pixels[own])]]
        )
        # Objects are over the table or just beside it: do not search the rest of a long arm.
        x, y, _ = blob.xyz
        near = np.flatnonzero(background.area.contains(x, y, _SEARCH_MARGIN))
        if len(near) == 0:
            return np.zeros_like(held)
        held[near] |= self._colours[kind].object_pixels(
            blob.pixels[near], blob.bins[near], frame.depth.shape[1]
        )
        return held

    def _joins(
        self, blob: Blob, found: dict[str, list[Blob]], boxes: dict[str, Box | None], width: int
    ) -> bool:
        """Whether a blob is part of a limb, separated from it by an occlusion; if so, adds it."""
        for kind, box in boxes.items():
            near = box is not None and _near(blob.pixels, box, width)
            if near and self._colours[kind].explains(blob.bins):
                found[kind].append(blob)
                return True
        return False

    def _result(
        self,
        found: dict[str, list[Blob]],
        objects: list[Blob],
        frame: RgbdFrame,
        background: Background,
        foreground: ImageB,
    ) -> HandArmSegmentation:
        hand, arm = merged(found['hand']), merged(found['arm'])
        self._previous = {'hand': hand.pixels, 'arm': arm.pixels}
        colour = self._colours['hand'].log_density
        more = complete_by_colour(frame, background, hand.pixels, colour, foreground)
        return HandArmSegmentation(
            np.concatenate([hand.pixels, more]),
            arm.pixels,
            _area_over_table(hand, frame.depth, background, _HAND_MARGIN),
            _area_over_table(arm, frame.depth, background),
            hand_tip(hand, background, self._config.human_sides),
            tuple(objects),
            not self._reaches_in,
        )


def _box(blobs: list[Blob], width: int) -> Box | None:
    """First and last row and column of some blobs, with a margin; None without pixels."""
    pixels = merged(blobs).pixels
    # All pixels of a limb may have been assigned to the object it holds.
    if len(pixels) == 0:
        return None
    rows, columns = rows_and_columns(pixels, width)
    return (
        int(rows.min()) - _BOX_MARGIN,
        int(rows.max()) + _BOX_MARGIN,
        int(columns.min()) - _BOX_MARGIN,
        int(columns.max()) + _BOX_MARGIN,
    )


def _near(pixels: Index, box: Box, width: int) -> bool:
    """Whether the mean of some pixels lies within a box."""
    row, column = (float(v.mean()) for v in rows_and_columns(pixels, width))
    return box[0] < row < box[1] and box[2] < column < box[3]


def _area_over_table(
    blob: Blob, depth: ImageF, background: Background, margin: float = 0.0
) -> float:
    """Surface (m^2) of a blob that hides the table or is above it or its margin (m)."""
    x, y, _ = blob.xyz
    over = background.area.contains(x, y, margin) | background.table.take(blob.pixels)
    return float(background.view.pixel_area(depth.take(blob.pixels[over])).sum())

"""Split of blobs into convex parts, once for as long as a blob does not change."""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from likeme_perception.blobs import Blob, ImageF, Index, rows_and_columns
from likeme_perception.convexity import convex_parts
from likeme_perception.rgbd import RgbdFrame

# A blob is unchanged if its mask overlaps with the last one in this share of their union, and this
# share of its depths differ by less than _SAME_DEPTH, m.
_OVERLAP, _UNCHANGED_SHARE, _SAME_DEPTH = 0.9, 0.95, 0.015
# Margin, pixels, around a blob in which new pixels are counted to its parts.
_MARGIN = 4


@dataclass(frozen=True, eq=False)
class _SeenBlob:
    """A blob as it was first seen: its mask and depths in a part of the image.

    part: of each pixel there the part of the nearest pixel of the blob; None: not yet split.
    """

    top: int
    left: int
    mask: NDArray[np.bool_]
    depth: ImageF
    part: Index | None = None

    def at(self, pixels: Index, width: int) -> tuple[Index, Index] | None:
        """Rows and columns of pixels (flat indices) in its part of the image; None: outside."""
        rows, columns = rows_and_columns(pixels, width)
        rows, columns = rows - self.top, columns - self.left
        height, length = self.mask.shape
        inside = rows.min() >= 0 and rows.max() < height
        if inside and columns.min() >= 0 and columns.max() < length:
            return rows, columns
        return None

    def is_same(self, pixels: Index, depth: ImageF) -> bool:
        """Whether a blob of a later frame (H, W) is this one, unchanged."""
        at = self.at(pixels, depth.shape[1])
        if at is None:
            return False
        both = self.mask[at]
        shared = int(np.count_nonzero(both))
        if shared < _OVERLAP * (np.count_nonzero(self.mask) + len(pixels) - shared):
            return False
        near = np.abs(depth.take(pixels[both]) - self.depth[at][both]) < _SAME_DEPTH
        return bool(np.count_nonzero(near) > _UNCHANGED_SHARE * shared)


class ConvexSplitter:
    """Splits blobs that stay as they are for two frames, and remembers how."""

    def __init__(self) -> None:
        self._seen: list[_SeenBlob] = []

    def split(
        self, blobs: list[Blob], frame: RgbdFrame, camera: ImageF, least: float
    ) -> list[list[Blob]]:
        """The parts of each blob; one that is new, or does not come apart, is its only part.

        camera: its position, m. least: area of the smallest part, m^2.
        """
        seen, found = [], []
        for blob in blobs:
            if blob.area < 2 * least:
                found.append([blob])
                continue
            known = next((s for s in self._seen if s.is_same(blob.pixels, frame.depth)), None)
            if known is None:
                seen.append(_first_seen(blob, frame))
                found.append([blob])
                continue
            if known.part is None:
                known = _split(known, blob, frame, camera, least)
            seen.append(known)
            found.append(_parts(known, blob, frame.depth.shape[1], least))
        self._seen = seen
        return found


def _first_seen(blob: Blob, frame: RgbdFrame) -> _SeenBlob:
    height, width = frame.depth.shape
    rows, columns = rows_and_columns(blob.pixels, width)
    top, left = max(int(rows.min()) - _MARGIN, 0), max(int(columns.min()) - _MARGIN, 0)
    bottom = min(int(rows.max()) + _MARGIN + 1, height)
    right = min(int(columns.max()) + _MARGIN + 1, width)
    mask = np.zeros((bottom - top, right - left), bool)
    mask[rows - top, columns - left] = True
    return _SeenBlob(top, left, mask, frame.depth[top:bottom, left:right].copy())


def _split(
    known: _SeenBlob, blob: Blob, frame: RgbdFrame, camera: ImageF, least: float
) -> _SeenBlob:
    """The blob with its parts; pixels around it have the part of the nearest one."""
    points, eye = blob.points.astype(np.float64), np.asarray(camera, np.float64)
    part = convex_parts(points, eye, least / blob.area)
    now = _first_seen(blob, frame)
    at = now.at(blob.pixels, frame.depth.shape[1])
    if at is None:
        raise ValueError('Expected the pixels of a blob within its bounds, got others.')
    outside = np.ones(now.mask.shape, np.uint8)
    outside[at] = 0
    nearest = cv2.distanceTransformWithLabels(
        outside, cv2.DIST_L2, 3, labelType=cv2.DIST_LABEL_PIXEL
    )[1]
    of_label = np.zeros(int(nearest.max()) + 1, np.intp)
    of_label[nearest[at]] = part
    return replace(now, part=of_label[nearest])


def _parts(known: _SeenBlob, blob: Blob, width: int, least: float) -> list[Blob]:
    at = known.at(blob.pixels, width)
    if at is None or known.part is None or known.part.max() == 0:
        return [blob]
    part = known.part[at]
    parts = [blob.part(part == k) for k in range(int(part.max()) + 1)]
    return [p for p in parts if p.area >= least] or [blob]

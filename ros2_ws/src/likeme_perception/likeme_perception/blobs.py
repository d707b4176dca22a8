"""Blobs: connected components of a mask with their points and colours."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import cast

import cv2
import numpy as np
from numpy.typing import NDArray

from likeme_perception.camera_view import CameraView
from likeme_perception.colour import Bins, colour_bins
from likeme_perception.rgbd import RgbdFrame

ImageF = NDArray[np.float32]
ImageB = NDArray[np.uint8]
Index = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Blob:
    """Pixels of one surface.

    pixels: flat indices (N,). points: (N, 3) m, reference frame. bins: colour bins (N,). area:
    visible surface, m^2.
    """

    pixels: Index
    points: ImageF
    bins: Bins
    area: float

    @cached_property
    def xyz(self) -> ImageF:
        """The points' x, y and z, each contiguous, (3, N) m."""
        return np.ascontiguousarray(self.points.T)

    @property
    def extent(self) -> float:
        """Greatest length along x or y, m."""
        return float(np.ptp(self.xyz[:2], axis=1).max())

    def part(self, chosen: NDArray[np.bool_]) -> Blob:
        """The blob of the chosen pixels, with its share of the area."""
        at = np.flatnonzero(chosen)
        share = len(at) / max(len(self.pixels), 1)
        return Blob(
            self.pixels[at], self.points.take(at, axis=0), self.bins[at], self.area * share
        )


def blobs_of(regions: list[Index], frame: RgbdFrame, view: CameraView) -> list[Blob]:
    """One blob per region (flat indices); every pixel must have a depth reading."""
    if not regions:
        return []
    pixels = np.concatenate(regions)
    z = frame.depth.take(pixels)
    points, bins = view.points(pixels, z), colour_bins(frame.rgb, pixels)
    area = view.pixel_area(z)
    ends = np.cumsum([len(region) for region in regions])
    return [
        Blob(pixels[a:b], points[a:b], bins[a:b], float(area[a:b].sum()))
        for a, b in zip([0, *ends[:-1]], ends, strict=True)
    ]


def merged(blobs: list[Blob]) -> Blob:
    """Several blobs, or none, as one."""
    if not blobs:
        none = np.zeros(0, np.intp)
        return Blob(none, np.zeros((0, 3), np.float32), none.astype(np.int32), 0.0)
    if len(blobs) == 1:
        return blobs[0]
    return Blob(
        np.concatenate([b.pixels for b in blobs]),
        np.concatenate([b.points for b in blobs]),
        np.concatenate([b.bins for b in blobs]),
        sum(b.area for b in blobs),
    )


def image_components(mask: ImageB, least_pixels: int = 12) -> list[Index]:
    """Flat pixel indices of the 8-connected components of a mask, largest first."""
    _, top, _, high = cv2.boundingRect(mask)
    band = mask[top : top + high]
    inside = np.flatnonzero(band > 0)
    if len(inside) == 0:
        return []
    # Sorting the pixels by label is faster than cv2.connectedComponentsWithStats.
    label = cv2.connectedComponents(band, connectivity=8)[1].take(inside)
    ordered = inside[np.argsort(label, kind='stable')] + top * mask.shape[1]
    regions = np.split(ordered, np.cumsum(np.bincount(label))[:-1])
    return sorted((r for r in regions if len(r) >= least_pixels), key=len, reverse=True)


def rows_and_columns(pixels: Index, width: int) -> tuple[Index, Index]:
    """Rows and columns of flat pixel indices; much faster than np.divmod."""
    rows = pixels // width
    return rows, pixels - rows * width


def mask_of(pixels: Index, shape: tuple[int, int]) -> ImageB:
    """An image (H, W) of 0 and 1 from flat pixel indices."""
    mask = np.zeros(shape[0] * shape[1], np.uint8)
    mask[pixels] = 1
    return cast(ImageB, mask.reshape(shape))

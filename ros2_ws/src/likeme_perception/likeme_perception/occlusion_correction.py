"""Centroid of an object that is partly occluded by a hand or an arm."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from likeme_perception.blobs import Blob, rows_and_columns
from likeme_perception.camera_view import CameraView
from likeme_perception.top_view import Shape

ImageB = NDArray[np.uint8]

# Neighbourhood (pixels) of the visible part in which an occluder touches it.
_RIM = np.ones((9, 9), np.uint8)


def occlusion_direction(
    blob: Blob, hiding: ImageB, view: CameraView
) -> NDArray[np.float64] | None:
    """Unit vector (x, y) from the visible part to the occluder; None if none touches it."""
    height, width = hiding.shape
    rows, columns = rows_and_columns(blob.pixels, width)
    r0, r1 = max(int(rows.min()) - 5, 0), min(int(rows.max()) + 6, height)
    c0, c1 = max(int(columns.min()) - 5, 0), min(int(columns.max()) + 6, width)
    mine = np.zeros((r1 - r0, c1 - c0), np.uint8)
    mine[rows - r0, columns - c0] = 1
    rim = (cv2.dilate(mine, _RIM) > mine) & (hiding[r0:r1, c0:c1] > 0)
    ground = view.ground[r0:r1, c0:c1]
    if np.count_nonzero(rim) < 5:
        return None
    towards = np.asarray(ground[rim].mean(axis=0) - ground[mine > 0].mean(axis=0), np.float64)
    length = float(np.linalg.norm(towards))
    return towards / length if np.isfinite(length) and length > 1e-4 else None


def correct_occluded_shape(
    shape: Shape, blob: Blob, usual: Shape, hiding: ImageB, view: CameraView
) -> Shape:
    """The usual extents, with the centroid moved towards the occluder.

    Along that direction only a part of the usual length is seen:
    c = c_visible + direction (usual - seen) / 2.
    """
    towards = occlusion_direction(blob, hiding, view)
    whole = replace(usual, centroid=shape.centroid, height=max(shape.height, usual.height))
    if towards is None:
        return whole
    seen = float(np.ptp(np.percentile(blob.points[:, :2] @ towards, [2, 98])))
    shift = max(0.0, (usual.length + usual.width) / 2 - seen) / 2
    x, y, z = shape.centroid
    return replace(
        whole, centroid=(x + shift * float(towards[0]), y + shift * float(towards[1]), z)
    )

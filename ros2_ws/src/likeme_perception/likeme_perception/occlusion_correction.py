"""Where the middle of an object is when a hand or an arm hides part of it."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from likeme_perception.camera_view import TableView
from likeme_perception.segmentation import Blob, Shape, rows_and_columns

ImageB = NDArray[np.uint8]

# How far about the visible part the hidden part begins, pixels.
_RIM = np.ones((9, 9), np.uint8)


def hidden_direction(blob: Blob, hiding: ImageB, view: TableView) -> NDArray[np.float64] | None:
    """Unit vector (x, y) from the visible part to what hides the rest, None without."""
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


def with_hidden_part(
    shape: Shape, blob: Blob, usual: Shape, hiding: ImageB, view: TableView
) -> Shape:
    """The shape of a partly hidden object: usual axes, and its middle moved under what hides it.

    Along the way to the hidden part the object is as long as it usually is, of which only some is
    seen: c = c_visible + towards (usual - seen) / 2.
    """
    towards = hidden_direction(blob, hiding, view)
    whole = replace(usual, centroid=shape.centroid, height=max(shape.height, usual.height))
    if towards is None:
        return whole
    seen = float(np.ptp(np.percentile(blob.points[:, :2] @ towards, [2, 98])))
    shift = max(0.0, (usual.length + usual.width) / 2 - seen) / 2
    x, y, z = shape.centroid
    return replace(
        whole, centroid=(x + shift * float(towards[0]), y + shift * float(towards[1]), z)
    )

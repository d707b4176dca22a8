"""Rasterises triangles with NumPy: exact at pixel centres, without a loop over triangles.

A front-facing triangle becomes one span of pixels per image row, a span becomes fragments. Inverse
depth and brightness are linear in the image within a triangle (brightness nearly so), hence one
plane equation each, a u + b v + c.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from likeme_arm_sim.meshes import Floats
from likeme_core.camera_mount import CameraMount

Indices = NDArray[np.intp]

# Distance of the near plane, m: projection needs z > 0.
NEAR = 0.05


class Fragments(NamedTuple):
    """Candidate pixels, F of them.

    Attributes:
        pixel: (F,) index into the flattened image.
        inverse_depth: (F,) float32, 1/m along the optical axis.
        shade: (F,) float32, brightness.
        triangle: (F,) index of the triangle.
    """

    pixel: Indices
    inverse_depth: NDArray[np.float32]
    shade: NDArray[np.float32]
    triangle: Indices


def clip_near(corners: Floats) -> tuple[Floats, Indices]:
    """Cut triangles at the near plane.

    Args:
        corners: (T, 3, 4) corners in the optical frame: x, y, z in m, and brightness.

    Returns:
        The triangles beyond the near plane (T', 3, 4), and the index of each one's original (T',).
    """
    before = corners[:, :, 2] > NEAR
    whole = np.flatnonzero(before.all(axis=1))
    if len(whole) == len(corners):
        return corners, whole
    pieces, origin = [corners[whole]], [whole]
    for index in np.flatnonzero(before.any(axis=1) & ~before.all(axis=1)):
        fan = _cut(corners[index])
        pieces.append(fan)
        origin.append(np.full(len(fan), index))
    return np.concatenate(pieces), np.concatenate(origin)


def _cut(triangle: Floats) -> Floats:
    """The part of one triangle (3, 4) beyond the near plane, as 1 or 2 triangles (_, 3, 4)."""
    kept = []
    for start, end in zip(triangle, np.roll(triangle, -1, axis=0), strict=True):
        if start[2] > NEAR:
            kept.append(start)
        if (start[2] > NEAR) != (end[2] > NEAR):
            kept.append(start + (end - start) * (NEAR - start[2]) / (end[2] - start[2]))
            kept[-1][2] = NEAR
    return np.array([[kept[0], kept[k], kept[k + 1]] for k in range(1, len(kept) - 1)])


def project(corners: Floats, camera: CameraMount) -> Floats:
    """Corners (T, 3, 4) in the optical frame to (T, 3, 4): u px, v px, 1/z, brightness."""
    image = np.empty_like(corners)
    inverse = 1.0 / corners[:, :, 2]
    image[:, :, 0] = camera.fx * corners[:, :, 0] * inverse + camera.cx
    image[:, :, 1] = camera.fy * corners[:, :, 1] * inverse + camera.cy
    image[:, :, 2] = inverse
    image[:, :, 3] = corners[:, :, 3]
    return image


def fragments(image: Floats, width: int, height: int) -> Fragments:
    """All pixels whose centres lie in the projected, front-facing triangles (T, 3, 4)."""
    planes = _planes(image)
    triangle, row = _rows(image[:, :, 1], height)
    left, right = _span_ends(image, triangle, row)
    start = np.ceil(np.clip(left, 0, width)).astype(np.intp)
    count = np.maximum(np.ceil(np.clip(right, 0, width)).astype(np.intp) - start, 0)
    full = count > 0
    triangle, row, start, count = triangle[full], row[full], start[full], count[full]
    stop = np.cumsum(count)
    span = np.repeat(np.arange(len(count)), count)
    base = row * width + start
    pixel = np.arange(stop[-1] if len(stop) else 0) + (base - (stop - count))[span]
    # Counted from the first pixel of each span, float32 keeps the planes exact to 1e-7.
    step = (pixel - base[span]).astype(np.float32)
    values = []
    for slope_u, slope_v, constant in planes:
        first = slope_u[triangle] * start + slope_v[triangle] * row + constant[triangle]
        value = slope_u[triangle].astype(np.float32)[span]
        value *= step
        value += first.astype(np.float32)[span]
        values.append(value)
    return Fragments(pixel, values[0], values[1], triangle[span])


def _planes(image: Floats) -> list[tuple[Floats, Floats, Floats]]:
    """Coefficients (a, b, c), each (T,), of inverse depth and of brightness over the image."""
    (u0, v0), (u1, v1), (u2, v2) = (image[:, k, :2].T for k in range(3))
    determinant = (u1 - u0) * (v2 - v0) - (u2 - u0) * (v1 - v0)
    scale = 1.0 / np.where(np.abs(determinant) < 1e-12, np.inf, determinant)
    planes = []
    for channel in (2, 3):
        w0, w1, w2 = image[:, :, channel].T
        a = ((w1 - w0) * (v2 - v0) - (w2 - w0) * (v1 - v0)) * scale
        b = ((w2 - w0) * (u1 - u0) - (w1 - w0) * (u2 - u0)) * scale
        planes.append((a, b, w0 - a * u0 - b * v0))
    return planes


def _rows(v: Floats, height: int) -> tuple[Indices, Indices]:
    """Every (triangle, image row) pair in which the triangle (T, 3 corners' v) has a part."""
    top = np.ceil(np.clip(v.min(axis=1), 0, height)).astype(np.intp)
    count = np.ceil(np.clip(v.max(axis=1), 0, height)).astype(np.intp) - top
    triangle = np.repeat(np.arange(len(v)), count)
    row = np.arange(len(triangle)) + (top - (np.cumsum(count) - count))[triangle]
    return triangle, row


def _span_ends(image: Floats, triangle: Indices, row: Indices) -> tuple[Floats, Floats]:
    """Where each row enters and leaves its triangle, u in px: a pixel is in if left <= u < right.

    Outward counter-clockwise triangles run anticlockwise on the screen too, where v points down:
    edges that go down bound the left side, edges that go up the right side.
    """
    left, right = np.full(len(row), -np.inf), np.full(len(row), np.inf)
    for k in range(3):
        (u, v), (u_next, v_next) = image[:, k, :2].T, image[:, (k + 1) % 3, :2].T
        rise = v_next - v
        slope = (u_next - u) / np.where(rise == 0, 1.0, rise)
        offset = u - v * slope
        edge = slope[triangle] * row
        np.maximum(left, edge + np.where(rise > 0, offset, -np.inf)[triangle], out=left)
        np.minimum(right, edge + np.where(rise < 0, offset, np.inf)[triangle], out=right)
    return left, right

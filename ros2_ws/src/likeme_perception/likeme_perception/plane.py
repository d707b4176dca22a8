"""Plane fitting: RANSAC and least squares."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from likeme_perception.errors import NoTableError

Points = NDArray[np.floating]


@dataclass(frozen=True)
class Plane:
    """All points p with normal . p + offset = 0; the unit normal points at the camera."""

    normal: tuple[float, float, float]
    offset: float

    def height(self, points: Points) -> NDArray[np.floating]:
        """Signed distance of points (..., 3) from the plane, m."""
        return np.asarray(points @ np.asarray(self.normal, points.dtype) + self.offset)


def least_squares_plane(points: Points) -> Plane:
    """The plane with the least summed squared distance from points (N, 3), facing the origin."""
    if len(points) < 3:
        raise NoTableError(f'Expected at least 3 points for a plane, got {len(points)}.')
    centre = points.mean(axis=0)
    normal = np.linalg.svd((points - centre).T @ (points - centre))[0][:, 2]
    offset = -float(normal @ centre)
    sign = 1.0 if offset >= 0 else -1.0
    n = [float(sign * v) for v in normal]
    return Plane((n[0], n[1], n[2]), sign * offset)


def refine_plane(points: Points, plane: Plane, tolerance: float, rounds: int = 4) -> Plane:
    """Refit on the points within a tolerance (m) that shrinks to 2.5 robust deviations."""
    for _ in range(rounds):
        height = plane.height(points)
        near = np.abs(height) < tolerance
        if near.sum() < 3:
            return plane
        plane = least_squares_plane(points[near])
        spread = 1.4826 * float(np.median(np.abs(plane.height(points[near]))))
        tolerance = min(tolerance, max(2.5 * spread, 0.002))
    return plane


def ransac_plane(
    points: Points, rng: np.random.Generator, tolerance: float = 0.01, trials: int = 200
) -> Plane:
    """The plane with most of the (N, 3) points within tolerance (m), refined by least squares."""
    points = np.asarray(points[np.isfinite(points).all(axis=1)], np.float64)
    if len(points) < 30:
        raise NoTableError(
            f'Expected at least 30 points with depth for a plane, got {len(points)}.'
        )
    sample = points[rng.choice(len(points), min(len(points), 2500), replace=False)]
    best, best_count = None, -1
    for _ in range(trials):
        a, b, c = sample[rng.choice(len(sample), 3, replace=False)]
        normal = np.cross(b - a, c - a)
        length = float(np.linalg.norm(normal))
        if length < 1e-6:
            continue
        count = int((np.abs((sample - a) @ (normal / length)) < tolerance).sum())
        if count > best_count:
            best, best_count = least_squares_plane(np.stack([a, b, c])), count
    if best is None:
        raise NoTableError('Expected points that span a plane, got points on one line.')
    return refine_plane(points, best, tolerance)

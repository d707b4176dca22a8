"""Split of a surface where it is concave: objects that touch or are stacked, of any colour.

Locally convex connected patches (Stein, Schoeler, Papon and Woergoetter, CVPR 2014): the surface
is divided into voxels and these into patches of similar normals; neighbouring patches belong to
one object if the surface between them is convex or nearly flat. A part that is itself concave is
the inside of a vessel and belongs to it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix, csr_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

Floats = NDArray[np.float64]
Index = NDArray[np.intp]

# Edge of a voxel, m; radius in which its normal is fitted and distance of neighbours, in edges.
_VOXEL, _NORMAL_RADIUS, _NEIGHBOUR = 0.006, 2.5, 1.75
# Size of a patch, m, and rounds in which its voxels are gathered.
_PATCH, _ROUNDS = 0.025, 3
# Normals that differ less than this, rad, are those of one surface whichever way it bends.
_FLAT = float(np.radians(15.0))
# Where normals differ by more than _CREASE, rad, surfaces that meet in a point only are no edge of
# one object: the line along which they would meet must be at least this far from their connection.
_STEEPEST_CREASE, _CREASE, _CREASE_SLOPE = np.radians(60.0), np.radians(25.0), 0.25
# Mean curvature, 1/m, of the inside of the widest vessel.
_CAVITY = -4.0


class _Voxels(NamedTuple):
    """Voxels of a surface.

    of: voxel of each point (N,). weight: points in each (V,). centre, normal: (V, 3), normals
    facing the camera. pairs: neighbours (P, 2); near: those whose points a normal is fitted to.
    """

    of: Index
    weight: Floats
    centre: Floats
    normal: Floats
    pairs: Index
    near: Index


def convex_parts(points: Floats, camera: Floats, least: float) -> Index:
    """The convex part to which each point belongs, (N,) from 0.

    points: (N, 3), m, of one connected surface. camera: its position, m. least: share of the
    points below which a part is counted to the neighbour that it touches most.
    """
    voxels = _voxels(points, camera)
    patch = _patches(voxels)
    part = _connected(_mean_patches(voxels, patch), patch, voxels.pairs)
    part = _merged(part, voxels, lambda p: _small(p, voxels, least * len(points)))
    return _merged(part, voxels, lambda p: _cavities(p, voxels))[voxels.of]


def _voxels(points: Floats, camera: Floats) -> _Voxels:
    key = np.floor(points / _VOXEL).astype(np.int64)
    key -= key.min(axis=0)
    size = key.max(axis=0) + 1
    flat = (key[:, 0] * size[1] + key[:, 1]) * size[2] + key[:, 2]
    _, of, count = np.unique(flat, return_inverse=True, return_counts=True)
    of, weight = of.ravel(), count.astype(float)
    centre = _sums(of, points, len(weight)) / weight[:, None]
    tree = cKDTree(centre)
    near = tree.query_pairs(_NORMAL_RADIUS * _VOXEL, output_type='ndarray')
    normal = _normals(points, of, weight, near)
    normal *= np.where(((camera - centre) * normal).sum(axis=1) < 0, -1.0, 1.0)[:, None]
    pairs = tree.query_pairs(_NEIGHBOUR * _VOXEL, output_type='ndarray')
    return _Voxels(of, weight, centre, normal, pairs, near)


def _sums(of: Index, values: Floats, count: int) -> Floats:
    """Sums of the rows of `values` (N, K) that belong to each of `count` groups, (count, K)."""
    columns = [np.bincount(of, column, count) for column in values.T]
    return np.stack(columns, axis=1)


def _normals(points: Floats, of: Index, weight: Floats, near: Index) -> Floats:
    """Unit normals (V, 3): the direction in which the points around a voxel vary least."""
    i, j = np.triu_indices(3)
    count = len(weight)
    moments = np.column_stack(
        [weight, _sums(of, points, count), _sums(of, points[:, i] * points[:, j], count)]
    )
    around = _graph(near, count) @ moments + moments
    mean = around[:, 1:4] / around[:, :1]
    spread = np.empty((count, 3, 3))
    spread[:, i, j] = around[:, 4:] / around[:, :1] - mean[:, i] * mean[:, j]
    # eigh reads the lower triangle.
    return np.asarray(np.linalg.eigh(spread.transpose(0, 2, 1))[1][:, :, 0])


def _graph(pairs: Index, count: int) -> csr_matrix:
    """The symmetric adjacency matrix of some pairs (P, 2); multiple pairs count as often."""
    a, b = pairs.T
    ones = np.ones(2 * len(pairs))
    return coo_matrix((ones, (np.r_[a, b], np.r_[b, a])), shape=(count, count)).tocsr()


def _patches(voxels: _Voxels) -> Index:
    """The patch of each voxel, (V,): k-means over place and normal, from a grid of seeds."""
    features = np.hstack([voxels.centre / _PATCH, voxels.normal])
    _, patch = np.unique(np.floor(voxels.centre / _PATCH), axis=0, return_inverse=True)
    patch = patch.ravel()
    for _ in range(_ROUNDS):
        count = np.bincount(patch)
        means = _sums(patch, features, len(count))[count > 0] / count[count > 0][:, None]
        patch = cKDTree(means).query(features)[1]
    return np.unique(patch, return_inverse=True)[1].ravel()


def _mean_patches(voxels: _Voxels, patch: Index) -> tuple[Floats, Floats]:
    """Centres and unit normals of the patches, (K, 3) each."""
    count, weight = int(patch.max()) + 1, voxels.weight[:, None]
    total = np.bincount(patch, voxels.weight, count)[:, None]
    centre = _sums(patch, voxels.centre * weight, count) / total
    normal = _sums(patch, voxels.normal * weight, count)
    return centre, normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-9)


def _connected(patches: tuple[Floats, Floats], patch: Index, pairs: Index) -> Index:
    """The part of each voxel, (V,): patches connected by convex or flat edges."""
    centre, normal = patches
    edges = np.unique(np.sort(patch[pairs], axis=1), axis=0)
    edges = edges[edges[:, 0] != edges[:, 1]]
    a, b = edges.T
    between = centre[a] - centre[b]
    between /= np.maximum(np.linalg.norm(between, axis=1, keepdims=True), 1e-9)
    angle = np.arccos(np.clip((normal[a] * normal[b]).sum(axis=1), -1, 1))
    convex = ((normal[a] - normal[b]) * between).sum(axis=1) > 0
    crease = np.cross(normal[a], normal[b])
    crease /= np.maximum(np.linalg.norm(crease, axis=1, keepdims=True), 1e-9)
    off = np.arccos(np.clip(np.abs((crease * between).sum(axis=1)), 0, 1))
    least = _STEEPEST_CREASE / (1 + np.exp(-_CREASE_SLOPE * np.degrees(angle - _CREASE)))
    joined = (convex & (off > least)) | (angle < _FLAT)
    graph = _graph(edges[joined], len(centre))
    return np.asarray(connected_components(graph, directed=False)[1])[patch]


def _merged(part: Index, voxels: _Voxels, wrong: Callable[[Index], Floats]) -> Index:
    """The parts after those that are none were counted to the neighbour they touch most.

    wrong: of each part how wrong it is to be one; 0 or less: it is one.
    """
    while True:
        borders = _graph(part[voxels.pairs], int(part.max()) + 1).toarray()
        np.fill_diagonal(borders, 0)
        amount = np.where(borders.any(axis=1), wrong(part), 0)
        worst = int(amount.argmax())
        if amount[worst] <= 0:
            return part
        part = np.where(part == worst, borders[worst].argmax(), part)
        part = np.unique(part, return_inverse=True)[1].ravel()


def _small(part: Index, voxels: _Voxels, least: float) -> Floats:
    """By how many points each part is too small."""
    return np.asarray(least - np.bincount(part, voxels.weight))


def _cavities(part: Index, voxels: _Voxels) -> Floats:
    """By how much, 1/m, the mean curvature of each part is that of a cavity."""
    a, b = voxels.near[part[voxels.near[:, 0]] == part[voxels.near[:, 1]]].T
    away, turned = voxels.centre[a] - voxels.centre[b], voxels.normal[a] - voxels.normal[b]
    count = int(part.max()) + 1
    bent = np.bincount(part[a], (away * turned).sum(axis=1), count)
    length = np.bincount(part[a], (away * away).sum(axis=1), count)
    return np.asarray(_CAVITY - bent / np.maximum(length, 1e-12))

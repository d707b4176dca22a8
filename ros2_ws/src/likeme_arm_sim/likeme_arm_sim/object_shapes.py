"""Convex parts of an object from its entry in the world file: meshes and primitives."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from likeme_arm_sim.meshes import Colour, ConvexMesh, box, capsule, convex_hull, ellipsoid, lathe

GREY: Colour = (150, 150, 150)


def object_parts(simulation: Mapping[str, Any], folder: Path) -> tuple[ConvexMesh, ...]:
    """The parts of an object; folder: of the world file, from which meshes are read.

    Raises:
        ValueError: a mesh cannot be read.
    """
    return tuple(part for entry in simulation['parts'] for part in _parts(entry, folder))


def _parts(entry: Mapping[str, Any], folder: Path) -> list[ConvexMesh]:
    colour = entry.get('colour')
    if 'mesh' in entry:
        return [_mesh(folder / entry['mesh'], colour)]
    plain: Colour = GREY if colour is None else (colour[0], colour[1], colour[2])
    at = np.array(entry.get('at', (0.0, 0.0, 0.0)), float)
    if 'box' in entry:
        x, y, z = map(float, entry['box'])
        return [box((x, y, z), plain, (float(at[0]), float(at[1]), float(at[2])))]
    if 'ellipsoid' in entry:
        x, y, z = map(float, entry['ellipsoid'])
        return [ellipsoid((x, y, z), plain).moved(at)]
    if 'capsule' in entry:
        rod = entry['capsule']
        ends, radius = (rod['from'], rod['to']), float(rod['radius'])
        return [capsule(*ends, radius, plain, float(rod.get('end_radius', radius)))]
    return [lathe([(float(x), float(radius)) for x, radius in entry['lathe']], plain)]


def _mesh(path: Path, colour: Any) -> ConvexMesh:
    """A mesh file; what is not convex is replaced by its hull. Colours of faces are kept."""
    try:
        mesh = trimesh.load_mesh(path, process=False, maintain_order=True)
    except Exception as error:  # trimesh raises what its many parsers raise
        raise ValueError(f'Expected a mesh in {path}, got: {error}.') from None
    if not isinstance(mesh, trimesh.Trimesh) or len(mesh.faces) < 4:
        raise ValueError(f'Expected a mesh of 4 triangles or more in {path}, got none.')
    vertices = np.asarray(mesh.vertices, float)
    plain: Colour = GREY if colour is None else (colour[0], colour[1], colour[2])
    part = ConvexMesh(
        vertices,
        np.asarray(mesh.faces, np.int32),
        np.tile(np.asarray(plain, np.uint8), (len(mesh.faces), 1)),
    )
    if not part.contains(vertices).all():
        return convex_hull(vertices, plain)
    visual: Any = mesh.visual
    if colour is None and visual.kind in ('face', 'vertex'):
        faces = np.asarray(visual.face_colors, np.uint8)[:, :3]
        return ConvexMesh(part.vertices, part.triangles, np.ascontiguousarray(faces))
    return part

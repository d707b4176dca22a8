"""The three toys as physical things: shape, mass and friction, and their bullet bodies."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from types import MappingProxyType

import numpy as np
import pybullet as bullet

from likeme_arm_sim.meshes import ConvexMesh, Floats
from likeme_arm_sim.toy_shapes import chicken_parts, lemon_parts, pear_parts

# Bullet grows every hull by this margin, m; the collision shape is made that much smaller, so that
# it touches where the camera sees the surface.
HULL_MARGIN = 0.001


@dataclass(frozen=True)
class Toy:
    """One toy in its own frame: origin at the centre of mass, long axis x, upright axis z.

    Attributes:
        parts: convex parts, together the whole surface; both collided with and seen.
        mass: kg.
        inertia: diagonal of the inertia tensor about the origin for uniform density, kg m^2.
        friction: Coulomb coefficient against the table.
        rolling_friction, spinning_friction: bullet's torsional coefficients, m.
        restitution: share of the normal velocity kept in a bounce.
        size: length along x, width along y, height along z, m.
        resting_height: z of the origin above the table when it lies as it is placed, m.
    """

    name: str
    parts: tuple[ConvexMesh, ...]
    mass: float
    inertia: tuple[float, float, float]
    friction: float
    rolling_friction: float
    spinning_friction: float
    restitution: float
    size: tuple[float, float, float]
    resting_height: float

    @property
    def length(self) -> float:
        """Extent along the long axis, m."""
        return self.size[0]


def _mass_properties(parts: tuple[ConvexMesh, ...], step: float = 0.003) -> tuple[Floats, Floats]:
    """Centre of mass (3,), m, and inertia diagonal per mass (3,), m^2, of the parts' union."""
    cloud = np.concatenate([part.vertices for part in parts])
    axes = [np.arange(a, b, step) for a, b in zip(cloud.min(0), cloud.max(0), strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing='ij'), axis=-1).reshape(-1, 3)
    inside = grid[np.any([part.contains(grid) for part in parts], axis=0)]
    centre = inside.mean(axis=0)
    square = ((inside - centre) ** 2).mean(axis=0)
    return centre, square.sum() - square


def _toy(
    name: str,
    parts: tuple[ConvexMesh, ...],
    mass: float,
    friction: float,
    rolling_friction: float,
    restitution: float,
) -> Toy:
    """The toy with its origin moved to the centre of mass."""
    centre, radii = _mass_properties(parts)
    centred = tuple(part.moved(-centre) for part in parts)
    cloud = np.concatenate([part.vertices for part in centred])
    size, inertia = np.ptp(cloud, axis=0), mass * radii
    return Toy(
        name=name,
        parts=centred,
        mass=mass,
        inertia=(float(inertia[0]), float(inertia[1]), float(inertia[2])),
        friction=friction,
        rolling_friction=rolling_friction,
        spinning_friction=0.0008,
        restitution=restitution,
        size=(float(size[0]), float(size[1]), float(size[2])),
        resting_height=float(-cloud[:, 2].min()),
    )


TOYS: Mapping[str, Toy] = MappingProxyType(
    {
        'pear': _toy('pear', pear_parts(), 0.050, 0.45, 0.0004, 0.15),
        'lemon': _toy('lemon', lemon_parts(), 0.040, 0.45, 0.0003, 0.20),
        'chicken': _toy('chicken', chicken_parts(), 0.060, 0.55, 0.0020, 0.05),
    }
)


def collision_shape(parts: tuple[ConvexMesh, ...], client: int) -> int:
    """Bullet's compound of the convex parts' hulls, each drawn in by the collision margin.

    Bullet reads compounds of hulls from files alone: one Wavefront object becomes one hull.
    """
    text, first = [], 1
    for index, part in enumerate(parts):
        vertices = _drawn_in(part.vertices, HULL_MARGIN)
        text.append(f'o part_{index}')
        text.extend('v {:.7f} {:.7f} {:.7f}'.format(*vertex) for vertex in vertices)
        text.extend('f {} {} {}'.format(*triangle) for triangle in part.triangles + first)
        first += len(vertices)
    with TemporaryDirectory() as folder:
        path = Path(folder) / 'parts.obj'
        path.write_text('\n'.join(text) + '\n')
        shape = bullet.createCollisionShape(
            bullet.GEOM_MESH, fileName=str(path), physicsClientId=client
        )
    if shape < 0:
        raise ValueError(f'Expected a compound of {len(parts)} hulls, got shape {shape}.')
    return int(shape)


def _drawn_in(vertices: Floats, margin: float) -> Floats:
    """Vertices moved inwards so that a ball of radius `margin` swept over them fits the body."""
    middle = (vertices.max(axis=0) + vertices.min(axis=0)) / 2
    half = np.ptp(vertices, axis=0) / 2
    return np.asarray(middle + (vertices - middle) * np.maximum(1 - margin / half, 0.2))


def spawn(
    toy: Toy,
    client: int,
    position: tuple[float, float, float],
    orientation: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0),
) -> int:
    """Put a toy into a bullet world; position m, orientation (x, y, z, w). Returns the body id."""
    body = bullet.createMultiBody(
        baseMass=toy.mass,
        baseCollisionShapeIndex=collision_shape(toy.parts, client),
        basePosition=position,
        baseOrientation=orientation,
        physicsClientId=client,
    )
    bullet.changeDynamics(
        body,
        -1,
        lateralFriction=toy.friction,
        rollingFriction=toy.rolling_friction,
        spinningFriction=toy.spinning_friction,
        restitution=toy.restitution,
        localInertiaDiagonal=toy.inertia,
        linearDamping=0.02,
        angularDamping=0.02,
        physicsClientId=client,
    )
    return int(body)

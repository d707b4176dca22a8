"""The objects of a world: shape, mass properties, and their bullet bodies."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pybullet as bullet

from likeme_arm_sim.meshes import ConvexMesh, Floats
from likeme_arm_sim.object_shapes import object_parts
from likeme_arm_sim.physics import ToyPhysics, toy_physics
from likeme_core.world import World
from likeme_core.world.values import ObjectEntry

# Bullet adds this margin to every hull, m; the collision shape is made that much smaller, so that
# its surface is where the camera sees it.
HULL_MARGIN = 0.001
# Spacing of the points that the inertia is computed from, m.
GRID = 0.003


@dataclass(frozen=True)
class Toy:
    """One toy in its own frame: origin at the centre of mass, long axis x, upright axis z.

    Attributes:
        parts: convex parts of the surface, for collisions and for drawing.
        physics: mass, friction and bounce.
        gyration: diagonal of the inertia tensor about the origin per mass, for uniform density,
            m^2.
        size: length along x, width along y, height along z, m.
        resting_height: z of the origin above the table at rest, m.
    """

    name: str
    parts: tuple[ConvexMesh, ...]
    physics: ToyPhysics
    gyration: tuple[float, float, float]
    size: tuple[float, float, float]
    resting_height: float

    @property
    def inertia(self) -> tuple[float, float, float]:
        """Diagonal of the inertia tensor about the origin, kg m^2."""
        x, y, z = (self.physics.mass * radius for radius in self.gyration)
        return x, y, z

    def with_physics(self, physics: ToyPhysics) -> Toy:
        """The same shape with other physical parameters."""
        return replace(self, physics=physics)


def _mass_properties(parts: tuple[ConvexMesh, ...]) -> tuple[Floats, Floats]:
    """Centre of mass (3,), m, and inertia diagonal per mass (3,), m^2, of the parts' union."""
    cloud = np.concatenate([part.vertices for part in parts])
    axes = [np.arange(a, b, GRID) for a, b in zip(cloud.min(0), cloud.max(0), strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing='ij'), axis=-1).reshape(-1, 3)
    inside = grid[np.any([part.contains(grid) for part in parts], axis=0)]
    centre = inside.mean(axis=0)
    square = ((inside - centre) ** 2).mean(axis=0)
    return centre, square.sum() - square


def toys_of(world: World) -> dict[str, Toy]:
    """The objects of a world by name.

    Raises:
        ValueError: the world file has no `simulation` for one of them, or a mesh is not usable.
    """
    return {entry.name: _toy(entry, world.folder) for entry in world.object_entries}


@lru_cache(maxsize=64)
def _toy(entry: ObjectEntry, folder: Path) -> Toy:
    """The toy with its origin moved to the centre of mass."""
    if entry.simulation is None:
        raise ValueError(
            f"Expected 'simulation' of {entry.name} in the world file, got none: it cannot be "
            'simulated.'
        )
    parts = object_parts(entry.simulation, folder)
    centre, gyration = _mass_properties(parts)
    centred = tuple(part.moved(-centre) for part in parts)
    cloud = np.concatenate([part.vertices for part in centred])
    size = np.ptp(cloud, axis=0)
    return Toy(
        name=entry.name,
        parts=centred,
        physics=toy_physics(entry.simulation),
        gyration=(float(gyration[0]), float(gyration[1]), float(gyration[2])),
        size=(float(size[0]), float(size[1]), float(size[2])),
        resting_height=float(-cloud[:, 2].min()),
    )


def collision_shape(parts: tuple[ConvexMesh, ...], client: int) -> int:
    """Bullet's compound of the convex parts' hulls, each shrunk by the collision margin.

    Bullet reads compounds of hulls only from files: one Wavefront object becomes one hull.
    """
    text, first = [], 1
    for index, part in enumerate(parts):
        vertices = _shrunk(part.vertices, HULL_MARGIN)
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


def _shrunk(vertices: Floats, margin: float) -> Floats:
    """Vertices moved inwards so that a ball of radius `margin` swept over them fits the body."""
    middle = (vertices.max(axis=0) + vertices.min(axis=0)) / 2
    half = np.ptp(vertices, axis=0) / 2
    return np.asarray(middle + (vertices - middle) * np.maximum(1 - margin / half, 0.2))


def spawn(toy: Toy, client: int, position: tuple[float, float, float]) -> int:
    """Add an upright toy to a bullet client at a position, m. Returns the body id."""
    body = bullet.createMultiBody(
        baseMass=toy.physics.mass,
        baseCollisionShapeIndex=collision_shape(toy.parts, client),
        basePosition=position,
        physicsClientId=client,
    )
    bullet.changeDynamics(
        body,
        -1,
        lateralFriction=toy.physics.friction,
        rollingFriction=toy.physics.rolling_friction,
        spinningFriction=toy.physics.spinning_friction,
        restitution=toy.physics.restitution,
        localInertiaDiagonal=toy.inertia,
        linearDamping=toy.physics.linear_damping,
        angularDamping=toy.physics.angular_damping,
        physicsClientId=client,
    )
    return int(body)

"""A pybullet client with gravity, the table, the floor and the objects."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import pybullet
from numpy.typing import NDArray

from likeme_arm_sim.bullet import connect
from likeme_arm_sim.physics import Physics
from likeme_arm_sim.toys import Toy, spawn
from likeme_core.table import Table

Vector = NDArray[np.float64]

# Physics and control steps per simulated second, and how long one lasts, s.
STEP_RATE = 240
TIME_STEP = 1.0 / STEP_RATE
# Of the constraint solver: greatest number of iterations, and the squared change of the impulses
# at which it stops. Resting objects and free fingers get there in a few iterations.
SOLVER_ITERATIONS, SOLVER_RESIDUAL = 80, 1e-4
# m.
FLOOR_HALF_SIZE = 3.0


class Pose(NamedTuple):
    """Position (m, base_link) and orientation (quaternion xyzw) of a body."""

    position: Vector
    orientation: Vector

    def matrix(self) -> Vector:
        """4x4 transform from the body to base_link."""
        matrix = np.eye(4)
        rotation = pybullet.getMatrixFromQuaternion(self.orientation)
        matrix[:3, :3] = np.asarray(rotation).reshape(3, 3)
        matrix[:3, 3] = self.position
        return matrix


class PhysicsWorld:
    """Physics of table, floor and objects; arm and hand add themselves to `client`."""

    def __init__(
        self, table: Table, toys: Mapping[str, Toy], physics: Physics | None = None
    ) -> None:
        self._table, self.physics = table, physics or Physics()
        toys = {
            name: toy.with_physics(self.physics.toys.get(name, toy.physics))
            for name, toy in toys.items()
        }
        self.client: Any = connect()
        self.client.setGravity(0.0, 0.0, self.physics.gravity)
        self.client.setPhysicsEngineParameter(
            fixedTimeStep=TIME_STEP,
            numSolverIterations=SOLVER_ITERATIONS,
            solverResidualThreshold=SOLVER_RESIDUAL,
            deterministicOverlappingPairs=1,
        )
        self.steps = 0
        self._resting_heights = {name: toy.resting_height for name, toy in toys.items()}
        self._widths = {name: toy.size[1] for name, toy in toys.items()}
        self.table, self.floor = self._add_table(), self._add_floor()
        self.toys = {
            name: spawn(toy, self.client._client, (float(index), 5.0, 0.0))
            for index, (name, toy) in enumerate(toys.items())
        }

    def save(self) -> int:
        """Save the present state, contacts included; its id for `restart`."""
        return int(self.client.saveState())

    def restart(self, saved: int) -> None:
        """Return to a saved state, with time zero."""
        self.client.restoreState(saved)
        self.steps = 0

    @property
    def time(self) -> float:
        """Simulated time, s."""
        return self.steps * TIME_STEP

    def step(self) -> None:
        """Advance by one step, 1/240 s."""
        pybullet.stepSimulation(self.client._client)
        self.steps += 1

    def toy_pose(self, name: str) -> Pose:
        """The true pose of a toy."""
        position, orientation = self.client.getBasePositionAndOrientation(self.toys[name])
        return Pose(np.array(position), np.array(orientation))

    def put_toy(self, name: str, x: float, y: float, ground: float, yaw: float) -> None:
        """Put a toy somewhere at rest: for setting up the table, never in a trial."""
        body = self.toys[name]
        orientation = pybullet.getQuaternionFromEuler((0.0, 0.0, yaw))
        z = ground + self._resting_heights[name] + 0.001
        self.client.resetBasePositionAndOrientation(body, (x, y, z), orientation)
        self.client.resetBaseVelocity(body, (0, 0, 0), (0, 0, 0))

    def resting_height(self, name: str) -> float:
        """Height of a toy's centre of mass above the ground it lies on, m."""
        return self._resting_heights[name]

    def width(self, name: str) -> float:
        """Extent of a toy across its long axis, m."""
        return self._widths[name]

    def toy_speed(self, name: str) -> float:
        """Speed of a toy, m/s."""
        return float(np.linalg.norm(self.client.getBaseVelocity(self.toys[name])[0]))

    def _add_table(self) -> int:
        top, table = self._table.top, self._table
        half = ((top.x_max - top.x_min) / 2, (top.y_max - top.y_min) / 2, table.thickness / 2)
        return self._add_slab(half, (*top.centre, -table.thickness / 2))

    def _add_floor(self) -> int:
        half = (FLOOR_HALF_SIZE, FLOOR_HALF_SIZE, 0.05)
        return self._add_slab(half, (0.0, 0.0, self._table.floor_z - 0.05))

    def _add_slab(self, half: tuple[float, ...], centre: tuple[float, ...]) -> int:
        shape = self.client.createCollisionShape(pybullet.GEOM_BOX, halfExtents=half)
        # A rigid body: as a multibody each contact with it costs twice as many terms, all zero.
        body = self.client.createMultiBody(
            0.0, shape, basePosition=centre, useMaximalCoordinates=True
        )
        # Bullet multiplies restitutions: with 1, each toy's own counts.
        friction = self.physics.ground_friction
        self.client.changeDynamics(body, -1, lateralFriction=friction, restitution=1.0)
        return int(body)

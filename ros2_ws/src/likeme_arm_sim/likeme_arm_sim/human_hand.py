"""The person's hand: a body dragged along a path, which pushes or holds toys.

A strong constraint drags the body, so that it moves what it touches by contact. A grasp is a fixed
constraint between hand and toy, because people rarely let things slip.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
import pybullet

from likeme_arm_sim.hand_shapes import Posture, Side, hand_parts
from likeme_arm_sim.meshes import ConvexMesh
from likeme_arm_sim.physics_world import TIME_STEP, PhysicsWorld, Vector
from likeme_arm_sim.toys import collision_shape

# Out of the camera's view, forearm included (test_simulated_person.py projects it).
AWAY = np.array([1.75, 0.0, 0.30])
# Between thumb and fingers of an open hand, m.
OPEN = 0.095


class HumanHand:
    """A left and a right hand, one of them in use; motions call `tick` at every physics step.

    Positions are of the hand frame's origin (see hand_shapes.py), m, base_link.
    """

    def __init__(
        self, physics_world: PhysicsWorld, tick: Callable[[], None], sides: Iterable[Side] = Side
    ) -> None:
        """sides: hands that exist; none, if there is no person."""
        self._physics_world, self._tick = physics_world, tick
        self._client = physics_world.client
        self._physics = physics_world.physics.hand
        self._bodies = {side: self._add_body(side) for side in sides}
        self._anchors = {side: self._add_anchor(body) for side, body in self._bodies.items()}
        self._grip: int | None = None
        self.side, self.posture, self.yaw, self.opening = Side.LEFT_HAND, Posture.PUSH, 0.0, OPEN
        self.goal: Vector = AWAY
        self.reset()

    def reset(self) -> None:
        """Put empty hands out of view: for setting up the table only."""
        self.release()
        for side in self._bodies:
            self.goal, self.side = AWAY, side
            self._client.resetBasePositionAndOrientation(self._bodies[side], AWAY, (0, 0, 0, 1))
            self._client.resetBaseVelocity(self._bodies[side], (0, 0, 0), (0, 0, 0))
            self._drag()

    @property
    def away(self) -> bool:
        """Whether the hand is out of the camera's view."""
        return bool(np.allclose(self.goal, AWAY, atol=0.01))

    @property
    def position(self) -> Vector:
        """The true position of the hand."""
        return np.array(self._client.getBasePositionAndOrientation(self._bodies[self.side])[0])

    @property
    def parts(self) -> tuple[ConvexMesh, ...]:
        """The visible parts of the hand, in the hand frame."""
        # Rounded, so that the cached shapes are few.
        yaw, opening = round(self.yaw, 1), round(self.opening, 2)
        return tuple(hand_parts(self.posture, yaw, opening, self.side).values())

    def take(
        self, side: Side, posture: Posture, touches: str | None = None, yaw: float = 0.0
    ) -> None:
        """Choose hand and posture, and the only toy that it collides with; only while away.

        Raises:
            ValueError: the hand does not exist.
        """
        if side not in self._bodies:
            raise ValueError(f'Expected a hand that exists, got {side.name}.')
        self.side, self.posture, self.yaw, self.opening = side, posture, yaw, OPEN
        for name, toy in self._physics_world.toys.items():
            solid = int(name == touches)
            self._client.setCollisionFilterPair(self._bodies[side], toy, -1, -1, solid)

    def move_to(self, goal: Vector, speed: float) -> None:
        """Move in a straight line with minimum jerk; `speed` is the mean speed, m/s."""
        start, change = self.goal, goal - self.goal
        seconds = max(float(np.linalg.norm(change)) / speed, 0.1)
        for share in minimum_jerk(int(np.ceil(seconds / TIME_STEP))):
            self.hold_at(start + share * change)

    def hold_at(self, goal: Vector) -> None:
        """Drag the hand towards a position for one control step."""
        self.goal = goal
        self._drag()
        self._tick()

    def wait(self, seconds: float) -> None:
        """Keep still for a time."""
        for _ in range(round(seconds / TIME_STEP)):
            self.hold_at(self.goal)

    def open_to(self, opening: float, seconds: float) -> None:
        """Move the fingers until thumb and fingers are `opening` m apart."""
        for between in np.linspace(self.opening, opening, max(1, round(seconds / TIME_STEP))):
            self.opening = float(between)
            self.hold_at(self.goal)

    def grasp(self, name: str) -> None:
        """Attach a toy to the hand."""
        toy = self._physics_world.toy_pose(name)
        offset = (toy.position - self.position).tolist()
        self._grip = self._client.createConstraint(
            self._bodies[self.side], -1, self._physics_world.toys[name], -1, pybullet.JOINT_FIXED,
            (0, 0, 0), offset, (0, 0, 0), toy.orientation.tolist(),
        )  # fmt: skip
        self._client.changeConstraint(self._grip, maxForce=self._physics.grip_force)

    def release(self) -> None:
        """Detach the held toy, if any."""
        if self._grip is not None:
            self._client.removeConstraint(self._grip)
        self._grip = None

    def halt(self) -> None:
        """Stop within this control step."""
        if self.side not in self._bodies:
            return
        self._client.resetBaseVelocity(self._bodies[self.side], (0, 0, 0), (0, 0, 0))
        self.goal = self.position
        self._drag()

    def _drag(self) -> None:
        self._client.changeConstraint(
            self._anchors[self.side],
            self.goal.tolist(),
            jointChildFrameOrientation=(0, 0, 0, 1),
            maxForce=self._physics.drag_force,
        )

    def _add_body(self, side: Side) -> int:
        parts = hand_parts(Posture.PUSH, side=side)
        palm = tuple(mesh for name, mesh in parts.items() if name not in ('wrist', 'sleeve'))
        shape = collision_shape(palm, self._client._client)
        mass, friction = self._physics.mass, self._physics.friction
        body = int(self._client.createMultiBody(mass, shape, basePosition=AWAY.tolist()))
        self._client.changeDynamics(body, -1, lateralFriction=friction)
        self._client.setCollisionFilterGroupMask(body, -1, 0, 0)
        return body

    def _add_anchor(self, body: int) -> Any:
        fixed, origin = pybullet.JOINT_FIXED, (0, 0, 0)
        return self._client.createConstraint(body, -1, -1, -1, fixed, origin, origin, origin)


def minimum_jerk(count: int) -> Vector:
    """Fraction of the distance after each of `count` steps (Flash and Hogan 1985)."""
    t = np.arange(1, count + 1) / count
    return np.asarray(t**3 * (10 - 15 * t + 6 * t**2))

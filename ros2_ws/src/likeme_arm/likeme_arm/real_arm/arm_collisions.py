"""Collisions of the arm with itself, the table and other things, by coal through Pinocchio."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from likeme_arm.real_arm.arm_kinematics import ArmKinematics
from likeme_arm.tool_pose import Vector
from likeme_core.table import Table

#: Random configurations, and the share of them in collision from which on a pair of links is taken
#: for one that always touches, as MoveIt's setup assistant does.
SAMPLES, ALWAYS = 200, 0.95
SEED = 1


class Obstacle(NamedTuple):
    """A box on the table: what the camera sees of an object.

    x, y, yaw: m, rad, base_link. length, width, height: m.
    """

    name: str
    x: float
    y: float
    yaw: float
    length: float
    width: float
    height: float


class _Body(NamedTuple):
    """A convex part of the arm."""

    link: str
    joint: int
    number: int
    shape: Any
    corners: Vector
    finger: bool


class ArmCollisions:
    """Convex hulls of the arm's collision meshes, and what they may not touch.

    Attributes:
        ignored: pairs of links that are not checked: neighbours, and those that always touch.
    """

    def __init__(self, kinematics: ArmKinematics, table: Table) -> None:
        import coal

        self._coal, self._pin = coal, kinematics._pin
        self._kinematics, config = kinematics, kinematics.config
        model = kinematics.model
        self._data = kinematics.geometry.createData()
        fingers = set(config.finger_links)
        self._bodies = []
        for index, item in enumerate(kinematics.geometry.geometryObjects):
            shape = _convex(item.geometry)
            link = model.frames[item.parentFrame].name
            self._bodies.append(
                _Body(link, item.parentJoint, index, shape, _corners(shape), link in fingers)
            )
        top, thickness = table.top, table.thickness
        self._table = coal.Box(top.x_max - top.x_min, top.y_max - top.y_min, thickness)
        self._table_place = coal.Transform3s(np.eye(3), np.array([*top.centre, -thickness / 2]))
        self._request, self._result = coal.CollisionRequest(), coal.CollisionResult()
        self._pairs = [
            (a, b)
            for i, a in enumerate(self._bodies)
            for b in self._bodies[i + 1 :]
            if a.joint != b.joint and not _neighbours(model, a.joint, b.joint)
        ]
        self.ignored = self._ignore_touching()

    def problem(self, joints: Vector, obstacles: Sequence[Obstacle]) -> str | None:
        """What the arm would touch at these joint angles, or where it would leave; None: nothing.

        obstacles: of which the arm stays clear.
        """
        places = self._place(joints)
        config = self._kinematics.config
        for a, b in self._pairs:
            if self._touch(a.shape, places[a.number], b.shape, places[b.number], 0.0):
                return f'{a.link} would touch {b.link}'
        boxes = [(each, *self._box(each)) for each in obstacles]
        for body in self._bodies:
            if body.joint == 0:
                continue
            place = places[body.number]
            margin = 0.0 if body.finger else config.table_clearance
            if self._touch(body.shape, place, self._table, self._table_place, margin):
                return f'{body.link} would come too near to the table'
            for obstacle, shape, where in boxes:
                if self._touch(body.shape, place, shape, where, config.object_clearance):
                    return f'{body.link} would come too near to the {obstacle.name}'
        return None

    def extent(self, joints: Vector) -> tuple[Vector, Vector]:
        """Least and greatest x, y, z of all moving parts, m, base_link."""
        places = self._place(joints)
        corners = np.concatenate(
            [
                body.corners @ places[body.number].getRotation().T
                + places[body.number].getTranslation()
                for body in self._bodies
                if body.joint > 0
            ]
        )
        return corners.min(0), corners.max(0)

    def _place(self, joints: Vector) -> list[Any]:
        kinematics = self._kinematics
        self._pin.updateGeometryPlacements(
            kinematics.model, kinematics.data, kinematics.geometry, self._data,
            kinematics.configuration(joints),
        )  # fmt: skip
        return [self._coal.Transform3s(m.rotation, m.translation) for m in self._data.oMg]

    def _touch(self, a: Any, at: Any, b: Any, bt: Any, margin: float) -> bool:
        self._request.security_margin = margin
        self._result.clear()
        return bool(self._coal.collide(a, at, b, bt, self._request, self._result))

    def _box(self, item: Obstacle) -> tuple[Any, Any]:
        shape = self._coal.Box(item.length, item.width, item.height)
        turn = self._pin.rpy.rpyToMatrix(0.0, 0.0, item.yaw)
        return shape, self._coal.Transform3s(turn, np.array([item.x, item.y, item.height / 2]))

    def _ignore_touching(self) -> tuple[tuple[str, str], ...]:
        """Leave out pairs that touch nearly always, or with the arm at home or ready."""
        kinematics = self._kinematics
        rng, config = np.random.default_rng(SEED), kinematics.config
        counts = np.zeros(len(self._pairs))
        at_rest = np.zeros(len(self._pairs), bool)
        for joints in rng.uniform(
            kinematics.lower, kinematics.upper, (SAMPLES, len(kinematics.lower))
        ):
            counts += self._touching(joints)
        for joints in (config.home, config.ready):
            at_rest |= self._touching(joints)
        skipped = at_rest | (counts >= ALWAYS * SAMPLES)
        ignored = tuple(
            (a.link, b.link) for (a, b), skip in zip(self._pairs, skipped, strict=True) if skip
        )
        self._pairs = [p for p, skip in zip(self._pairs, skipped, strict=True) if not skip]
        return ignored

    def _touching(self, joints: Vector) -> Vector:
        places = self._place(joints)
        return np.array(
            [
                self._touch(a.shape, places[a.number], b.shape, places[b.number], 0.0)
                for a, b in self._pairs
            ]
        )


def _convex(shape: Any) -> Any:
    """The convex hull of a mesh; other shapes are convex already."""
    if hasattr(shape, 'buildConvexHull'):
        shape.buildConvexHull(True, 'Qt')
        shape = shape.convex
    shape.computeLocalAABB()
    return shape


def _corners(shape: Any) -> Vector:
    """The vertices of a hull, or the corners of another shape's own box, (N, 3)."""
    if hasattr(shape, 'points'):
        return np.array(shape.points())
    low, high = np.array(shape.aabb_local.min_), np.array(shape.aabb_local.max_)
    return np.array(np.meshgrid(*zip(low, high, strict=True))).reshape(3, -1).T


def _neighbours(model: Any, a: int, b: int) -> bool:
    return bool(model.parents[a] == b or model.parents[b] == a)

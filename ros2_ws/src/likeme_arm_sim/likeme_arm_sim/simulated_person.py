"""The simulated person: reaches in, places or pushes a toy, and withdraws the hand.

The person sees the objects: the hand uses their true poses.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from likeme_arm.motion import PrimitiveResult
from likeme_arm.tool_pose import wrap_half_turn
from likeme_arm_sim.hand_shapes import PALM_HEIGHT, Posture, Side
from likeme_arm_sim.human_hand import AWAY, OPEN, HumanHand
from likeme_arm_sim.physics_world import TIME_STEP, PhysicsWorld, Vector
from likeme_core.outcomes import MotionOutcome
from likeme_core.tabletop import Action
from likeme_core.world import World


@dataclass(frozen=True)
class PersonSettings:
    """Motions of the hand: heights above the table and distances m, speeds m/s.

    Attributes:
        speed: factor on all speeds.
        clear_height: above everything on the table.
        carry_height: over the table.
        gap: distance behind the toy's centre at which a push begins.
        reach_speed: in and out.
        act_speed: near toys.
        push_speed, push_deceleration: in contact; the latter m/s^2, so that nothing rolls away.
        beyond_edge: how far past the table's edge an object is put off it.
        palm: distance from the middle of the palm from which the hand follows a pushed toy.
        lead: distance before the target at which the push ends.
        room: to the next toy, where one is set down.
    """

    speed: float = 1.0
    clear_height: float = 0.20
    carry_height: float = 0.13
    gap: float = 0.065
    reach_speed: float = 1.3
    act_speed: float = 0.42
    push_speed: float = 0.25
    push_deceleration: float = 0.10
    beyond_edge: float = 0.09
    palm: float = 0.025
    lead: float = 0.03
    room: float = 0.13


class SimulatedPerson:
    """Executes the actions of a world with the hand."""

    def __init__(
        self, physics_world: PhysicsWorld, hand: HumanHand, world: World, settings: PersonSettings
    ) -> None:
        self._physics_world, self.hand = physics_world, hand
        self._world, self._table, self._s = world, world.table, settings

    def perform(
        self, name: str, action: Action, rng: np.random.Generator, share: float = 1.0
    ) -> PrimitiveResult:
        """Reach in, act and withdraw. Speed and places vary by `rng`.

        share: of the way, after which the person gives up and leaves the object there.
        """
        if not self.hand.away:
            self.withdraw()
        toy = self._physics_world.toy_pose(name).position
        handling = action.manner.handling
        if not handling.grasped and toy[2] < -self._table.thickness:
            reason = f'The {name} lies on the floor and cannot be pushed.'
            return PrimitiveResult(MotionOutcome.OBJECT_OFFTABLE, reason)
        pace = self._s.speed * float(rng.uniform(0.9, 1.1))
        spot = self._spot(name, action, rng)
        if share < 1:
            spot = toy[:2] + share * (spot - toy[:2])
        if handling.grasped:
            self._place(name, spot, pace, handling.fall)
        else:
            self._push(name, spot, pace)
        self._leave(pace)
        if share < 1:
            failed = f'The person gave up before the {name} was {action.target.name}.'
            return PrimitiveResult(MotionOutcome.COMPLETED, failed)
        return PrimitiveResult(
            MotionOutcome.COMPLETED,
            f'The person {handling.past} the {name} to {action.target.name}.',
        )

    def withdraw(self) -> None:
        """Let go, lift the hand and move it out of the camera's view."""
        self.hand.release()
        self._leave(self._s.speed)

    def _leave(self, pace: float) -> None:
        up = self.hand.goal.copy()
        up[2] = max(up[2], self._s.clear_height)
        self.hand.move_to(up, self._s.act_speed * pace)
        self.hand.move_to(AWAY, self._s.reach_speed * pace)

    def _place(self, name: str, spot: Vector, pace: float, fall: float) -> None:
        """Grasp, carry and release; fall: height to let it fall from, m, 0: set it down."""
        s, hand, toy = self._s, self.hand, self._physics_world.toy_pose(name)
        axis = toy.matrix()[:2, 0]
        # The fingers close across the long axis, in the direction nearer to yaw 0.
        yaw = wrap_half_turn(float(np.arctan2(axis[1], axis[0])))
        hand.take(Side.LEFT_HAND, Posture.GRASP, yaw=yaw)
        waypoints = self._approach(toy.position)
        hand.move_to(waypoints[0], s.reach_speed * pace)
        for point in waypoints[1:]:
            hand.move_to(point, s.act_speed * pace)
        hand.open_to(self._physics_world.width(name), 0.25 / pace)
        hand.grasp(name)
        for point in reversed(waypoints[:-1]):
            height = min(point[2], max(s.carry_height, fall))
            hand.move_to(np.array([*point[:2], height]), s.act_speed * pace)
        self._release(name, spot, pace, fall)

    def _release(self, name: str, spot: Vector, pace: float, fall: float) -> None:
        s, hand = self._s, self.hand
        above = np.array([*spot, max(s.carry_height, fall)])
        hand.move_to(above, s.act_speed * 1.2 * pace)
        below_hand = float(hand.position[2] - self._physics_world.toy_pose(name).position[2])
        low = self._ground(spot) + self._physics_world.resting_height(name) + below_hand + 0.004
        hand.move_to(np.array([*spot, fall or low]), s.act_speed * pace)
        hand.release()
        hand.open_to(OPEN, 0.25 / pace)

    def _push(self, name: str, spot: Vector, pace: float) -> None:
        s, hand = self._s, self.hand
        x, y, _ = self._physics_world.toy_pose(name).position
        side = Side.LEFT_HAND if spot[1] >= y else Side.RIGHT_HAND
        hand.take(side, Posture.PUSH, touches=name)
        behind = np.array([x, y - side.value * s.gap, PALM_HEIGHT + 0.003])
        hand.move_to(np.array([*behind[:2], s.clear_height]), s.reach_speed * pace)
        hand.move_to(behind, s.act_speed * pace)
        self._push_sideways(name, side.value, spot[1] - side.value * s.lead, pace)
        hand.wait(0.1)

    def _push_sideways(self, name: str, side: float, end: float, pace: float) -> None:
        """Move sideways to y = `end`, decelerating so that the toy does not roll away."""
        hand, s = self.hand, self._s
        step = 0.12 * TIME_STEP
        while (rest := side * (end - hand.goal[1])) > 0.0:
            speed = min(s.push_speed * pace, np.sqrt(2 * s.push_deceleration * rest) + 0.02)
            # The skin's friction keeps a rolling toy on its line: the hand follows only when the
            # toy is about to leave the palm.
            offset_x = self._physics_world.toy_pose(name).position[0] - hand.goal[0]
            follow = np.clip(np.sign(offset_x) * max(abs(offset_x) - s.palm, 0.0), -step, step)
            hand.hold_at(hand.goal + np.array([follow, side * speed * TIME_STEP, 0.0]))

    def _approach(self, toy: Vector) -> list[Vector]:
        """Waypoints from above to the toy, around the table's edge if it lies below the top."""
        x, y, z = toy
        top, high = self._table.top, self._s.clear_height
        if z > -self._table.thickness or not top.contains(x, y):
            return [np.array([x, y, high]), toy]
        outside = self._beyond_edge(y)
        return [np.array([x, outside, high]), np.array([x, outside, z]), toy]

    def _beyond_edge(self, y: float) -> float:
        """y past the side edge of the table that is nearer to `y`, m."""
        return (self._table.top.y_max + self._s.beyond_edge) * (1.0 if y > 0 else -1.0)

    def _ground(self, spot: Vector) -> float:
        table = self._table
        return 0.0 if table.top.contains(*spot) else table.floor_z

    def _spot(self, name: str, action: Action, rng: np.random.Generator) -> Vector:
        """A free place in the target area, or past the nearer side edge, (x, y), m."""
        region = self._world.region(action.target)
        x, y, _ = self._physics_world.toy_pose(name).position
        if region.person is None:
            return np.array([np.clip(x, *region.person_x), self._beyond_edge(y)])
        spots = np.column_stack(
            [
                low + (high - low) * rng.random(24)
                for low, high in (region.person.x, region.person.y)
            ]
        )
        if not action.manner.handling.grasped:
            # A push goes sideways: it cannot choose x.
            spots[:, 0] = x
        others = [
            self._physics_world.toy_pose(n).position[:2]
            for n in self._physics_world.toys
            if n != name
        ]
        room = [min((float(np.linalg.norm(o - at)) for o in others), default=1.0) for at in spots]
        free = [index for index, r in enumerate(room) if r > self._s.room]
        return np.asarray(spots[free[0] if free else int(np.argmax(room))])

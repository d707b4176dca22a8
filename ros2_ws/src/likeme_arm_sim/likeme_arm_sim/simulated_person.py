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
from likeme_arm_sim.scene import Scene
from likeme_core.outcomes import MotionOutcome
from likeme_core.tabletop import Action, Manner, State


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
        beyond_edge: how far past the table's edge OFFTABLE is.
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
    """Executes the six actions with the hand."""

    def __init__(
        self, world: PhysicsWorld, hand: HumanHand, scene: Scene, settings: PersonSettings
    ) -> None:
        self._world, self.hand, self._scene, self._s = world, hand, scene, settings

    def perform(self, name: str, action: Action, rng: np.random.Generator) -> PrimitiveResult:
        """Reach in, act and withdraw. Speed and places vary by `rng`."""
        if not self.hand.away:
            self.withdraw()
        toy = self._world.toy_pose(name).position
        if action.manner is Manner.PUSH and toy[2] < -self._scene.table.thickness:
            reason = f'The {name} lies on the floor and cannot be pushed.'
            return PrimitiveResult(MotionOutcome.OBJECT_OFFTABLE, reason)
        pace = self._s.speed * float(rng.uniform(0.9, 1.1))
        spot = self._spot(name, action, rng)
        act = self._push if action.manner is Manner.PUSH else self._place
        act(name, spot, pace)
        self._leave(pace)
        verb = 'pushed' if action.manner is Manner.PUSH else 'placed'
        return PrimitiveResult(
            MotionOutcome.COMPLETED, f'The person {verb} the {name} to {action.target.name}.'
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

    def _place(self, name: str, spot: Vector, pace: float) -> None:
        s, hand, toy = self._s, self.hand, self._world.toy_pose(name)
        axis = toy.matrix()[:2, 0]
        # The fingers close across the long axis, in the direction nearer to yaw 0.
        yaw = wrap_half_turn(float(np.arctan2(axis[1], axis[0])))
        hand.take(Side.LEFT, Posture.GRASP, yaw=yaw)
        waypoints = self._approach(toy.position)
        hand.move_to(waypoints[0], s.reach_speed * pace)
        for point in waypoints[1:]:
            hand.move_to(point, s.act_speed * pace)
        hand.open_to(self._world.width(name), 0.25 / pace)
        hand.grasp(name)
        for point in reversed(waypoints[:-1]):
            height = min(point[2], s.carry_height)
            hand.move_to(np.array([*point[:2], height]), s.act_speed * pace)
        self._set_down(name, spot, pace)

    def _set_down(self, name: str, spot: Vector, pace: float) -> None:
        s, hand = self._s, self.hand
        above = np.array([*spot, s.carry_height])
        hand.move_to(above, s.act_speed * 1.2 * pace)
        below_hand = float(hand.position[2] - self._world.toy_pose(name).position[2])
        low = self._ground(spot) + self._world.resting_height(name) + below_hand + 0.004
        hand.move_to(np.array([*spot, low]), s.act_speed * pace)
        hand.release()
        hand.open_to(OPEN, 0.25 / pace)

    def _push(self, name: str, spot: Vector, pace: float) -> None:
        s, hand = self._s, self.hand
        x, y, _ = self._world.toy_pose(name).position
        side = Side.LEFT if spot[1] >= y else Side.RIGHT
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
            offset_x = self._world.toy_pose(name).position[0] - hand.goal[0]
            follow = np.clip(np.sign(offset_x) * max(abs(offset_x) - s.palm, 0.0), -step, step)
            hand.hold_at(hand.goal + np.array([follow, side * speed * TIME_STEP, 0.0]))

    def _approach(self, toy: Vector) -> list[Vector]:
        """Waypoints from above to the toy, around the table's edge if it lies below the top."""
        x, y, z = toy
        top, high = self._scene.table.top, self._s.clear_height
        if z > -self._scene.table.thickness or not top.contains(x, y):
            return [np.array([x, y, high]), toy]
        outside = self._beyond_edge(y)
        return [np.array([x, outside, high]), np.array([x, outside, z]), toy]

    def _beyond_edge(self, y: float) -> float:
        """y past the side edge of the table that is nearer to `y`, m."""
        return (self._scene.table.top.y_max + self._s.beyond_edge) * (1.0 if y > 0 else -1.0)

    def _ground(self, spot: Vector) -> float:
        table = self._scene.table
        return 0.0 if table.top.contains(*spot) else table.floor_z

    def _spot(self, name: str, action: Action, rng: np.random.Generator) -> Vector:
        """A free place in the target area, or past the nearer side edge, (x, y), m."""
        target = action.target
        x, y, _ = self._world.toy_pose(name).position
        if target is State.OFFTABLE:
            return np.array([np.clip(x, 0.34, 0.52), self._beyond_edge(y)])
        sign = 1.0 if target is State.LEFT else -1.0
        spots = np.column_stack([rng.uniform(0.37, 0.51, 24), sign * rng.uniform(0.11, 0.22, 24)])
        if action.manner is Manner.PUSH:
            # A push goes sideways: it cannot choose x.
            spots[:, 0] = x
        others = [self._world.toy_pose(n).position[:2] for n in self._world.toys if n != name]
        room = [min((float(np.linalg.norm(o - at)) for o in others), default=1.0) for at in spots]
        free = [index for index, r in enumerate(room) if r > self._s.room]
        return np.asarray(spots[free[0] if free else int(np.argmax(room))])

"""A robot behind ros2_control's interfaces, in pybullet: what arm drivers are tested against."""

from __future__ import annotations

import json
import sys
import time
from importlib.util import find_spec
from typing import Any

import numpy as np
from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point
from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray, String
from trajectory_msgs.msg import JointTrajectory

from likeme_arm.real_arm.arm_config import load_arm_config
from likeme_arm_sim.layout import checked_states, draw_layout
from likeme_arm_sim.physics_world import TIME_STEP, PhysicsWorld
from likeme_arm_sim.stand_in.stand_in_robot import StandInRobot
from likeme_arm_sim.stand_in.trajectory_follower import (
    Fault,
    FaultKind,
    TrajectoryFollower,
    spline_of,
)
from likeme_arm_sim.toys import toys_of
from likeme_core.ros.spin import run_node
from likeme_core.ros.time import stamp_ns, steady_clock, time_msg
from likeme_core.ros.world import declare_world
from likeme_msgs.msg import ObjectState, TableState

#: s between two looks at the wall clock, two joint_states, two table states.
TICK, STATE_PERIOD, TABLE_PERIOD = 0.008, 0.01, 0.1
#: Steps to catch up at once; time beyond is lost, as on a robot whose computer is overloaded.
MOST_STEPS = 60
#: Extent that is told of each object, m: perception's are as large as the toys.
HEIGHT = 0.055


class RobotStandInNode(Node):
    """A joint trajectory controller and a gripper's controller on a simulated robot.

    Publishes:
        joint_states (JointState, 100 Hz), table_state (TableState, 10 Hz, the true poses),
        stand_in/report (String, JSON, 10 Hz): what was touched and which limits were broken
    Subscribes:
        CONTROLLER/joint_trajectory (JointTrajectory); with control_msgs it serves the action
        CONTROLLER/follow_joint_trajectory as well; the gripper's commands (Float64MultiArray), or
        its action GripperCommand, as the configuration has it
        stand_in/control (String, JSON): {"target": object, "fault": [kind, trajectory, at, amount]
        or null, "places": {object: state}, "seed": n}
    Parameters: arm (a configuration of likeme_arm), world, seed.
    """

    def __init__(self) -> None:
        super().__init__('robot_stand_in')
        self._table_world = declare_world(self)
        arm = self.declare_parameter('arm', 'panda').value
        seed = self.declare_parameter('seed', 1).value
        config = load_arm_config(arm)
        self._physics = PhysicsWorld(self._table_world.table, toys_of(self._table_world))
        self._robot = StandInRobot(self._physics, config)
        self._follower = TrajectoryFollower(config.home)
        self._config = config
        self._place(self._first_states(), seed)
        self._joint_pub = self.create_publisher(JointState, 'joint_states', 10)
        self._table_pub = self.create_publisher(TableState, 'table_state', 1)
        self._report_pub = self.create_publisher(String, 'stand_in/report', 1)
        self.create_subscription(
            JointTrajectory, f'{config.controller}/joint_trajectory', self._on_trajectory, 10
        )
        self._servers = self._action_servers()
        if config.gripper.kind == 'commands':
            self.create_subscription(Float64MultiArray, config.gripper.name, self._on_gripper, 10)
        self.create_subscription(String, 'stand_in/control', self._on_control, 10)
        self._began, self._steps = time.monotonic(), 0
        self._next_state = self._next_table = 0.0
        self.create_timer(TICK, self._tick, clock=steady_clock())
        self.get_logger().info(f'A robot like {config.name} is ready.')

    def _action_servers(self) -> list[Any]:
        """The actions of control_msgs that the configuration names.

        Raises:
            ValueError: gripper_command without control_msgs.
        """
        config, robot = self._config, self._robot
        gripper = config.gripper.kind == 'gripper_command'
        if find_spec('control_msgs') is None:
            if gripper:
                raise ValueError('Expected control_msgs for a gripper_command, found none.')
            return []
        from likeme_arm_sim.ros.gripper_server import GripperServer
        from likeme_arm_sim.ros.trajectory_server import TrajectoryServer

        servers: list[Any] = [
            TrajectoryServer(self, config.controller, self._follower, self._on_trajectory)
        ]
        if gripper:
            servers.append(GripperServer(
                self, config.gripper.name, config.gripper.positions, robot.grip,
                lambda: robot.gripper_position,
            ))  # fmt: skip
        return servers

    def _first_states(self) -> dict[str, Any]:
        world = self._table_world
        return {e.name: e.start if e.start is not None else world.states[0]
                for e in world.object_entries}  # fmt: skip

    def _tick(self) -> None:
        due = int((time.monotonic() - self._began) / TIME_STEP) - self._steps
        if due > MOST_STEPS:
            self._began += (due - MOST_STEPS) * TIME_STEP
            due = MOST_STEPS
        for _ in range(due):
            self._follower.advance(TIME_STEP)
            follower = self._follower
            self._robot.step(follower.joints, follower.velocities, follower.accelerations)
            self._steps += 1
        for server in self._servers:
            server.look()
        now = self._steps * TIME_STEP
        if now >= self._next_state:
            self._next_state = now + STATE_PERIOD
            self._publish_joints()
        if now >= self._next_table:
            self._next_table = now + TABLE_PERIOD
            self._publish_table()
            self._publish_report()

    def _publish_joints(self) -> None:
        if self._follower.now < self._follower.silent_until:
            return
        message = JointState(name=[*self._config.joints, self._config.gripper.joint])
        message.header.stamp = time_msg(time.time_ns())
        message.position = [*self._robot.joints.tolist(), self._robot.gripper_position]
        message.velocity = [*self._robot.velocities.tolist(), 0.0]
        self._joint_pub.publish(message)

    def _publish_table(self) -> None:
        world, stamp = self._table_world, time_msg(time.time_ns())
        message = TableState(world=world.label, reference_frame='base_link', settled=True)
        message.header.stamp, message.header.frame_id = stamp, 'base_link'
        message.objects = [self._object_state(name, stamp) for name in world.objects]
        self._table_pub.publish(message)

    def _object_state(self, name: str, stamp: Time) -> ObjectState:
        world = self._table_world
        pose = self._physics.toy_pose(name)
        x, y, z = map(float, pose.position)
        axis = pose.matrix()[:2, 0]
        state = world.regions.state_of(x, y, z)
        width = self._physics.width(name)
        return ObjectState(
            name=name, state=int(state), visible=True, settled=True,
            state_probability=[float(each == state) for each in world.states],
            centroid=Point(x=x, y=y, z=z),
            major_axis_yaw=float(np.arctan2(axis[1], axis[0])),
            major_axis_length=1.4 * width, minor_axis_length=width, height=HEIGHT,
            identity_probability=1.0, last_seen=stamp,
        )  # fmt: skip

    def _publish_report(self) -> None:
        robot = self._robot
        robot.count_self_collisions()
        report = {
            'collisions': robot.collisions,
            'violations': robot.violations,
            'fastest': robot.fastest,
            'hardest': robot.hardest,
        }
        self._report_pub.publish(String(data=json.dumps(report)))

    def _on_trajectory(self, message: JointTrajectory) -> None:
        if not message.points:
            self.get_logger().error('Empty trajectory received.')
            return
        stamp, robot = stamp_ns(message.header.stamp), self._robot
        if not self._follower.replace(
            spline_of(message, self._config.joints), (robot.joints, robot.velocities),
            (time.time_ns() - stamp) * 1e-9 if stamp else None,
        ):  # fmt: skip
            self.get_logger().error('Refused a trajectory that ends in the past or moving.')

    def _on_gripper(self, message: Float64MultiArray) -> None:
        self._robot.grip(float(message.data[0]))

    def _on_control(self, message: String) -> None:
        told = json.loads(message.data)
        self._robot.target = told.get('target', self._robot.target)
        if 'fault' in told:
            fault = told['fault']
            self._follower.inject(
                None if fault is None else Fault(FaultKind(fault[0]), *fault[1:])
            )
        if 'places' in told:
            self._place(told['places'], told.get('seed', 0))

    def _place(self, states: dict[str, Any], seed: int) -> None:
        """Put objects into states, as a person would while the arm is at home."""
        world = self._table_world
        wanted = checked_states(world, list(states), list(states.values()))
        layout = draw_layout(world, wanted, [], np.random.default_rng(seed))
        for name, place in layout.items():
            self._physics.put_toy(name, place.x, place.y, place.ground, place.yaw)


def main() -> int:
    """Run the node until SIGINT or SIGTERM."""
    return run_node('robot_stand_in', RobotStandInNode)


if __name__ == '__main__':
    sys.exit(main())

"""The driver of a real arm, through its joint trajectory controller."""

from __future__ import annotations

import sys
from typing import Any

from sensor_msgs.msg import JointState

from likeme_arm.motion_driver_node import MotionDriverNode
from likeme_arm.motion_journal import JournalError
from likeme_arm.real_arm.arm_config import load_arm_config
from likeme_arm.real_arm.arm_state import ArmState
from likeme_arm.real_arm.node_settings import SETTINGS, check_interface
from likeme_arm.real_arm.real_arm_driver import Controllers, RealArmDriver, RealArmSettings
from likeme_arm.ros.gripper_controllers import create_gripper_controller
from likeme_arm.ros.planned_path import PlannedPath
from likeme_arm.ros.table_state_topic import TableStateTopic
from likeme_arm.ros.trajectory_controllers import create_trajectory_controller
from likeme_core.outcomes import Actor
from likeme_core.ros.spin import join_graph, run_node


class RealArmDriverNode(MotionDriverNode):
    """The primitives on any arm with a URDF and a joint trajectory controller.

    Publishes:
        CONTROLLER/joint_trajectory (JointTrajectory), without control_msgs; the gripper's topic
        planned_path (MarkerArray, latched): the way of the grasp point, before each motion
        motion (Motion, reliable, transient local, depth 100), heartbeat (Heartbeat),
        /diagnostics (DiagnosticArray, 1 Hz), world (World, latched)
        arm/next_motion (String, latched), in step mode
    Subscribes:
        joint_states (JointState), table_state (TableState): where the objects are
        cell/hold_state (HoldState), cell/stop (String): asked at every step of a motion
    Serves:
        arm/execute_action (ExecuteAction, service and action), arm/motion_status (MotionStatus)
        arm/allow_motion (SetBool), in step mode
    Client:
        CONTROLLER/follow_joint_trajectory, the gripper's action, with control_msgs
        cell/hold (Trigger): of a keeper that missed a cell/stop
    Parameters: see real_arm.node_settings.SETTINGS.

    Stamps are of the system clock.
    """

    _driver: RealArmDriver

    def __init__(self) -> None:
        super().__init__(SETTINGS)
        values = self._values
        check_interface(values['controller_interface'])
        self._refuse_second([Actor.ROBOT])
        config = load_arm_config(values['arm'])
        self._state = ArmState(config)
        controllers = None
        if not values['dry_run']:
            controllers = Controllers(
                create_trajectory_controller(self, config, values['controller_interface']),
                create_gripper_controller(self, config.gripper),
            )
        self._journal = self._open_journal()
        self._path = PlannedPath(self, values['step'], lambda: self._driver.interrupted)
        settings = RealArmSettings(values['motion_budget'], values['table_state_timeout'])
        self._driver = RealArmDriver(
            self._world, config, self._state, controllers, self._hold, settings,
            self._path.announce, self._on_error, self._journal, self._on_motion,
        )  # fmt: skip
        self._serve_motions([Actor.ROBOT])
        self._table = TableStateTopic(self, self._driver)
        self.create_subscription(JointState, 'joint_states', self._on_joint_states, 10)
        self._start_driver()
        mode = ', dry run: nothing moves' if values['dry_run'] else ''
        mode += ', step mode: each motion is asked for' if values['step'] else ''
        self.get_logger().info(f'The driver of {config.name} is ready{mode}.')

    @property
    def _hardware(self) -> str:
        return self._driver.config.name

    def _facts(self) -> dict[str, Any]:
        return {
            'table_states_dropped': self._table.dropped,
            'joint_states_age_s': f'{self._state.age:.2f}',
        }

    def _on_joint_states(self, message: JointState) -> None:
        self._state.hear(message.name, message.position, message.velocity)


#: Of a standby process.
preload = join_graph


def main() -> int:
    """Run the node until SIGINT or SIGTERM."""
    return run_node(
        'arm_driver',
        RealArmDriverNode,
        start_errors=(ValueError, TypeError, OSError, JournalError, ImportError),
    )


if __name__ == '__main__':
    sys.exit(main())

"""The arm driver of the simulated cell: arm, person and camera, each of which may be left out."""

from __future__ import annotations

import sys
from typing import Any

import cv2
from rcl_interfaces.msg import SetParametersResult
from rclpy.parameter import Parameter
from rosgraph_msgs.msg import Clock

from likeme_arm.motion_driver_node import MotionDriverNode
from likeme_arm.motion_journal import JournalError
from likeme_arm_sim.cell import Cell
from likeme_arm_sim.node_settings import (
    SETTINGS,
    cell_settings,
    check_real_time_factor,
    sheets_on_table,
    simulation_settings,
)
from likeme_arm_sim.ros.arm_model import ArmModel
from likeme_arm_sim.ros.arm_topics import ArmTopics
from likeme_arm_sim.ros.camera_publisher import CameraPublisher
from likeme_arm_sim.ros.reset_service import ResetService
from likeme_arm_sim.simulated_parts import ALL_PARTS, SimulatedPart, simulated_parts
from likeme_arm_sim.simulation_driver import SimulationDriver
from likeme_core.outcomes import Actor
from likeme_core.ros.spin import join_graph, run_node
from likeme_core.ros.time import time_msg

STEPS_PER_CLOCK = 4


class ArmDriverNode(MotionDriverNode):
    """One simulated cell behind ROS interfaces; `simulate` says which of its parts.

    Publishes:
        arm: joint_states (JointState), tf (TFMessage) of the moving links with the same stamp,
        tf_static (TFMessage, latched), robot_description (String, latched).
        camera: camera/rgb/image_rect_color (Image, rgb8), camera/depth_registered/image_rect
        (Image, 16UC1 mm), and camera_info (CameraInfo) beside each, one stamp each frame;
        .../compressed and .../compressedDepth (CompressedImage) of both.
        All parts together: /clock (Clock). Always: /diagnostics (DiagnosticArray, 1 Hz),
        heartbeat (Heartbeat), motion (Motion, reliable, transient local, depth 100): each request
        when it begins and when it has ended.
    Subscribes:
        arm: table_state (TableState), where the arm believes the objects are.
        cell/hold_state (HoldState), cell/stop (String): asked at every control step; nothing moves
        unless the hold keeper is heard and allows it.
    Serves:
        arm: arm/execute_action (ExecuteAction), answered when the motion has ended;
        arm/motion_status (MotionStatus).
        person: human/execute_action, human/motion_status.
        Both: the action ExecuteAction of the same name, with feedback and cancel.
        camera: cell/reset (ResetCell).
    Client:
        cell/hold (Trigger): of a keeper that missed a cell/stop
    Parameters: see node_settings.SETTINGS.

    While a part is real, stamps are of the system clock. If drawing is slower than the camera's
    rate, simulated time slows down: no frame is skipped.
    """

    _driver: SimulationDriver
    _hardware = 'simulated cell'
    _error_prefix = 'Simulation step failed: '

    def __init__(self) -> None:
        super().__init__(SETTINGS)
        values = self._values
        parts, settings = simulated_parts(values['simulate']), simulation_settings(values)
        self._wall_time = settings.wall_time
        self.add_on_set_parameters_callback(self._check_parameters)
        self.add_post_set_parameters_callback(self._apply_parameters)

        seed, arm_visible = values['seed'], SimulatedPart.ARM in parts
        self._cell = Cell(
            self._world, seed, cell_settings(values, self._world), arm_visible,
            lambda: self._hold.block, sheets_on_table(values['calibration_board']),
            change=lambda: self._hold.change,
        )  # fmt: skip
        self._journal = self._open_journal()
        self._driver = SimulationDriver(
            self._cell, settings, self._on_step, self._on_error, self._journal, self._on_motion
        )
        self._driver.real_time_factor = values['real_time_factor']
        self._create_interfaces(parts, values['publish_clock'])
        self._start_driver()
        names = ', '.join(part for part in SimulatedPart if part in parts)
        self.get_logger().info(f'The cell is ready, seed {seed}, simulated: {names}.')

    def _create_interfaces(self, parts: frozenset[SimulatedPart], publish_clock: bool) -> None:
        arm, camera = SimulatedPart.ARM in parts, SimulatedPart.CAMERA in parts
        actors = [Actor.ROBOT] * arm + [Actor.HUMAN] * (SimulatedPart.PERSON in parts)
        self._refuse_second(actors)
        publishes_clock = publish_clock and parts == ALL_PARTS
        self._clock_publisher = (
            self.create_publisher(Clock, '/clock', 10) if publishes_clock else None
        )
        self._camera = CameraPublisher(self, self._cell) if camera else None
        self._arm = ArmTopics(self, self._driver) if arm else None
        self._arm_model = ArmModel(self, self._cell.arm) if arm else None
        self._serve_motions(actors)
        # Served with the part that it is about, so that a real one can serve it instead.
        self._reset = ResetService(self, self._driver) if camera else None

    def _check_parameters(self, changes: list[Parameter]) -> SetParametersResult:
        try:
            for change in changes:
                if change.name == 'real_time_factor':
                    check_real_time_factor(change.value, self._wall_time)
        except ValueError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _apply_parameters(self, changes: list[Parameter]) -> None:
        for change in changes:
            if change.name == 'real_time_factor':
                self._driver.real_time_factor = change.value

    def _on_step(self) -> None:
        """After every physics step, in the simulation's thread."""
        if (
            self._clock_publisher is not None
            and self._cell.physics_world.steps % STEPS_PER_CLOCK == 0
        ):
            self._clock_publisher.publish(Clock(clock=time_msg(self._driver.now)))
        if self._driver.frame_due:
            stamp = time_msg(self._driver.now)
            if self._arm is not None:
                self._arm.publish(stamp)
            if self._arm_model is not None:
                self._arm_model.publish(stamp)
            if self._camera is not None:
                self._camera.publish(stamp)

    def _facts(self) -> dict[str, Any]:
        return {
            'frames': self._camera.frames if self._camera else 0,
            'table_states_dropped': self._arm.dropped if self._arm else 0,
        }


#: Of a standby process.
preload = join_graph


def main() -> int:
    """Run the node until SIGINT or SIGTERM."""
    # Images this small gain nothing from OpenCV's threads, and on a loaded machine waiting for
    # them costs up to ten times the frame.
    cv2.setNumThreads(1)
    return run_node(
        'arm_driver', ArmDriverNode, start_errors=(ValueError, TypeError, OSError, JournalError)
    )


if __name__ == '__main__':
    sys.exit(main())

"""The arm driver: serves the simulated cell's robot, person and camera to ROS."""

from __future__ import annotations

import concurrent.futures
import sys
import traceback
from collections import Counter
from functools import partial

import cv2
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile
from rclpy.task import Future
from rosgraph_msgs.msg import Clock as ClockMessage
from sensor_msgs.msg import CameraInfo, Image, JointState
from std_srvs.srv import Trigger

from likeme_arm_sim import messages
from likeme_arm_sim.cell import Cell, MotionResult
from likeme_arm_sim.node_settings import SETTINGS, cell_settings, driver_settings
from likeme_arm_sim.scene import CAMERA_FRAME, Scene
from likeme_arm_sim.simulation_driver import SimulationDriver
from likeme_core.outcomes import Actor, MotionOutcome
from likeme_core.ros import parameters
from likeme_core.ros.spin import run_node
from likeme_core.ros.time import stamp_ns, steady_clock, time_msg
from likeme_msgs.msg import TableState
from likeme_msgs.srv import ExecuteAction, ResetCell

STEPS_PER_CLOCK = 4
#: s between log lines about one kind of error.
LOG_PERIOD = 5.0
BUSY = 'My last motion is still in progress: nothing was started.'
RESET_BUSY = 'A motion is in progress: hold it before the cell is reset.'


class ArmDriverNode(Node):
    """One simulated cell behind ROS interfaces.

    Publishes:
        camera/rgb/image_rect_color (Image, rgb8), camera/rgb/camera_info (CameraInfo) and
        camera/depth_registered/image_rect (Image, 16UC1 mm), one stamp each frame;
        joint_states (JointState); /clock (Clock); /diagnostics (DiagnosticArray, 1 Hz).
    Subscribes:
        table_state (TableState): where the arm believes the objects are.
    Serves:
        arm/execute_action, human/execute_action (ExecuteAction): answer when the motion has ended;
        cell/reset (ResetCell); cell/hold, cell/resume (Trigger).
    Parameters: see node_settings.SETTINGS.

    If drawing is slower than the camera's rate, simulated time slows down: no frame is skipped.
    """

    def __init__(self) -> None:
        super().__init__('arm_driver')
        parameters.declare(self, SETTINGS)
        values = parameters.values(self, SETTINGS)
        self.add_post_set_parameters_callback(self._apply_parameters)

        self._cell = Cell(Scene(), values['seed'], cell_settings(values))
        settings = driver_settings(values)
        self._driver = SimulationDriver(self._cell, settings, self._publish_due, self._on_error)
        self._driver.real_time_factor = values['real_time_factor']
        self._publishes_clock = values['publish_clock']
        self._counts = Counter(frames=0, motions=0, refused=0, table_states_dropped=0)

        self._create_publishers()
        self.create_subscription(TableState, 'table_state', self._on_table_state, 1)
        self._create_services()
        self.create_timer(1.0, self._diagnose, clock=steady_clock())
        self._driver.start()
        self.get_logger().info(f'The cell is ready, seed {values["seed"]}.')

    def stop(self) -> None:
        """End a running motion at once, for good, and wait until nothing is being published."""
        self._driver.stop()

    def destroy_node(self) -> None:
        """Destroy the node, the simulation's thread first."""
        self.stop()
        super().destroy_node()

    def _create_publishers(self) -> None:
        images = QoSProfile(depth=5)
        self._rgb = self.create_publisher(Image, 'camera/rgb/image_rect_color', images)
        self._depth = self.create_publisher(Image, 'camera/depth_registered/image_rect', images)
        self._info = self.create_publisher(CameraInfo, 'camera/rgb/camera_info', images)
        self._info_message = messages.camera_info_message(self._cell.scene.camera)
        self._joints = self.create_publisher(JointState, 'joint_states', 10)
        self._clock_publisher = self.create_publisher(ClockMessage, '/clock', 10)
        self._diagnostics = self.create_publisher(DiagnosticArray, '/diagnostics', 10)

    def _create_services(self) -> None:
        # Their callbacks await the end of a motion: meanwhile others must be told BUSY.
        group = ReentrantCallbackGroup()
        for actor, name in ((Actor.ROBOT, 'arm'), (Actor.HUMAN, 'human')):
            serve, service = partial(self._execute, actor), f'{name}/execute_action'
            self.create_service(ExecuteAction, service, serve, callback_group=group)
        self.create_service(ResetCell, 'cell/reset', self._reset, callback_group=group)
        self.create_service(Trigger, 'cell/hold', self._hold)
        self.create_service(Trigger, 'cell/resume', self._resume)

    def _apply_parameters(self, changes: list[Parameter]) -> None:
        for change in changes:
            if change.name == 'real_time_factor':
                self._driver.real_time_factor = change.value

    async def _execute(
        self, actor: Actor, request: ExecuteAction.Request, response: ExecuteAction.Response
    ) -> ExecuteAction.Response:
        expires = stamp_ns(request.expires)
        job = self._driver.act(actor, request.object, request.action, expires)
        if job is None:
            result = MotionResult(MotionOutcome.BUSY, BUSY)
        else:
            await self._end_of(job)
            result = job.result()
        self._counts['refused' if result.started is None else 'motions'] += 1
        self.get_logger().info(f'{result.outcome.name}: {result.message}')
        return messages.motion_response(result, self._driver, response)

    async def _reset(
        self, request: ResetCell.Request, response: ResetCell.Response
    ) -> ResetCell.Response:
        job = self._driver.reset(list(request.objects), list(request.states), request.seed)
        if job is None:
            response.message = RESET_BUSY
            return response
        await self._end_of(job)
        error = job.exception()
        response.success = error is None
        response.message = 'The table is set up.' if error is None else str(error)
        return response

    def _end_of(self, job: concurrent.futures.Future) -> Future:
        """The end of a job in the simulation's thread, to be awaited in the executor's.

        A done Future of rclpy does not wake the executor that waits for something to do.
        """
        ended = Future()

        def tell(_: concurrent.futures.Future) -> None:
            ended.set_result(None)
            self.executor.wake()

        job.add_done_callback(tell)
        return ended

    def _hold(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.success, response.message = True, self._driver.hold()
        return response

    def _resume(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.success, response.message = True, self._driver.resume()
        return response

    def _on_table_state(self, message: TableState) -> None:
        try:
            views = messages.object_views(message)
        except ValueError as error:
            self._counts['table_states_dropped'] += 1
            self.get_logger().warning(str(error), throttle_duration_sec=LOG_PERIOD)
            return
        self._driver.perceived.take(stamp_ns(message.header.stamp), views)

    def _on_error(self, error: Exception) -> None:
        told = ''.join(traceback.format_exception(error)).strip()
        self.get_logger().error(
            f'The cell stumbled and goes on: {told}', throttle_duration_sec=LOG_PERIOD
        )

    def _publish_due(self) -> None:
        """After every physics step, in the simulation's thread."""
        if self._publishes_clock and self._cell.world.steps % STEPS_PER_CLOCK == 0:
            now = time_msg(self._driver.now)
            self._clock_publisher.publish(ClockMessage(clock=now))
        if self._driver.frame_due:
            stamp = time_msg(self._driver.now)
            self._joints.publish(messages.joint_state_message(self._cell.arm, stamp))
            self._publish_frame(stamp)

    def _publish_frame(self, stamp: Time) -> None:
        publishers = (self._info, self._rgb, self._depth)
        if not any(publisher.get_subscription_count() for publisher in publishers):
            return
        images = self._cell.frame()
        rgb = messages.image_message(images.rgb, 'rgb8')
        depth = messages.image_message(images.depth_mm, '16UC1')
        for publisher, message in zip(publishers, (self._info_message, rgb, depth), strict=True):
            message.header.stamp = stamp
            message.header.frame_id = CAMERA_FRAME
            publisher.publish(message)
        self._counts['frames'] += 1

    def _diagnose(self) -> None:
        self._diagnostics.publish(messages.diagnostics_message(self._driver, self._counts))


def main() -> int:
    """Run the node until SIGINT or SIGTERM."""
    # Images this small gain nothing from OpenCV's threads, and on a busy machine their waiting for
    # each other costs up to ten times the frame.
    cv2.setNumThreads(1)
    return run_node('arm_driver', ArmDriverNode)


if __name__ == '__main__':
    sys.exit(main())

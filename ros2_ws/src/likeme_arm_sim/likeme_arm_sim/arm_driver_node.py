"""The arm driver: serves the simulated cell's robot, person and camera to ROS."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any

import cv2
import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.clock import Clock, ClockType
from rclpy.exceptions import InvalidParameterValueException
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rosgraph_msgs.msg import Clock as ClockMessage
from sensor_msgs.msg import CameraInfo, Image, JointState
from std_srvs.srv import Trigger

from likeme_arm_sim import messages
from likeme_arm_sim.cell import Actor, Cell, CellSettings, MotionResult
from likeme_arm_sim.pacer import Pacer
from likeme_arm_sim.primitives import ObjectView, Outcome
from likeme_arm_sim.scene import Scene
from likeme_arm_sim.worker import Worker
from likeme_arm_sim.world import STEP_RATE
from likeme_msgs.msg import TableState
from likeme_msgs.srv import ExecuteAction, ResetCell

RCLError = rclpy_implementation.RCLError

STEPS_PER_CLOCK = 4
BUSY = 'My last motion is still in progress: nothing was started.'
RESET_BUSY = 'A motion is in progress: hold it before the cell is reset.'
DEFAULT_STATES = ['pear:RIGHT', 'lemon:LEFT', 'chicken:RIGHT']


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
    Parameters: see _declare_parameters.

    A running motion drives simulated time; when nothing moves a steady timer does. If drawing is
    slower than the camera's rate, simulated time slows down: no frame is skipped.
    """

    def __init__(self) -> None:
        super().__init__('arm_driver')
        self._declare_parameters()
        self.cell = Cell(Scene(), self._get('seed'), self._settings())

        # All that touches the simulation runs there, one job at a time. Robot and person wait for
        # each other: a hand that is leaving must not make the arm refuse its turn.
        self._worker = Worker(self._idle, self._on_idle_error)
        self._epoch = time.time_ns() - round(self.cell.time * 1e9)
        self._steps_per_frame = max(1, round(STEP_RATE / self._get('camera_rate')))
        self._pacer = Pacer()
        self._views: dict[str, ObjectView] = {}
        self._views_stamp = self._reset_stamp = 0
        self._to_tidy = False
        # What the service callback that has just returned set going, if anything.
        self._begun: Future[Any] | None = None
        self._counts = {'frames': 0, 'motions': 0, 'refused': 0, 'table_states_dropped': 0}

        self._create_publishers()
        self.create_subscription(TableState, 'table_state', self._on_table_state, 1)
        self._create_services()
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(1.0, self._diagnose, clock=steady)
        self._pacer.restart(self.cell.time)
        self._worker.start()
        self.get_logger().info(f'The cell is ready, seed {self._get("seed")}.')

    def stop(self) -> None:
        """End a running motion at once, for good, and wait until nothing is being published."""
        self.cell.hold()
        self._worker.stop()

    def _declare_parameters(self) -> None:
        self._declare('seed', 1, 'Of first places, camera noise and person.', (0, 2**31))
        self._declare('initial_states', DEFAULT_STATES, "First states, as 'pear:RIGHT'.")
        self._declare('arm_speed', 1.0, "Factor on the arm's speeds.", (0.2, 1.5))
        self._declare('human_speed', 1.0, "Factor on the person's speeds.", (0.3, 2.0))
        self._declare('camera_rate', 30.0, 'Frames per simulated second.', (1.0, 60.0))
        self._declare('publish_clock', True, 'Publish simulated time on /clock.')
        self._declare('motion_budget', 60.0, 'Simulated s a motion may take.', (5.0, 600.0))
        self._declare(
            'table_state_timeout', 2.0, 'Simulated s a table_state may be acted on.', (0.1, 60.0)
        )
        self._declare(
            'real_time_factor',
            1.0,
            'Simulated s per s; 0: as fast as it goes (/clock may go back at a restart).',
            (0.0, 100.0),
            fixed=False,
        )

    def _declare(
        self,
        name: str,
        default: Any,
        description: str,
        limits: tuple[float, float] | None = None,
        fixed: bool = True,
    ) -> None:
        descriptor = ParameterDescriptor(description=description, read_only=fixed)
        if limits and isinstance(default, int):
            span = IntegerRange(from_value=int(limits[0]), to_value=int(limits[1]))
            descriptor.integer_range = [span]
        elif limits:
            reach = FloatingPointRange(from_value=limits[0], to_value=limits[1])
            descriptor.floating_point_range = [reach]
        self.declare_parameter(name, default, descriptor)

    def _get(self, name: str) -> Any:
        return self.get_parameter(name).value

    def _settings(self) -> CellSettings:
        return CellSettings(
            arm_speed=self._get('arm_speed'),
            human_speed=self._get('human_speed'),
            initial_states=messages.initial_states(self._get('initial_states')),
        )

    def _create_publishers(self) -> None:
        images = QoSProfile(depth=5)
        self._rgb = self.create_publisher(Image, 'camera/rgb/image_rect_color', images)
        self._depth = self.create_publisher(Image, 'camera/depth_registered/image_rect', images)
        self._info = self.create_publisher(CameraInfo, 'camera/rgb/camera_info', images)
        self._info_message = messages.camera_info_message(self.cell.scene.camera)
        self._joints = self.create_publisher(JointState, 'joint_states', 10)
        self._clock_publisher = self.create_publisher(ClockMessage, '/clock', 10)
        self._diagnostics = self.create_publisher(DiagnosticArray, '/diagnostics', 10)

    def _create_services(self) -> None:
        for actor, name in ((Actor.ROBOT, 'arm'), (Actor.HUMAN, 'human')):
            service = self.create_service(
                ExecuteAction,
                f'{name}/execute_action',
                lambda request, response, actor=actor: self._execute(actor, request, response),
            )
            self._answer_later(service, self._answer)
        service = self.create_service(ResetCell, 'cell/reset', self._reset)
        self._answer_later(service, self._answer_reset)
        self.create_service(Trigger, 'cell/hold', self._hold)
        self.create_service(Trigger, 'cell/resume', self._resume)

    def _answer_later(self, service: Any, fill: Callable[[Any, Future[Any]], Any]) -> None:
        """Let a service answer when the job that its callback began has ended.

        rclpy answers as soon as a callback returns. Waiting in the callback would need its
        MultiThreadedExecutor, which spins while a callback waits for a thread and was seen to take
        nine tenths of the simulation's time on a busy machine; so the answer itself waits.
        """
        send = service.send_response

        def when_done(response: Any, header: Any) -> Callable[[Future[Any]], None]:
            def answer(done: Future[Any]) -> None:
                if self.context.ok():
                    send(fill(response, done), header)

            return answer

        def send_when_done(response: Any, header: Any) -> None:
            job, self._begun = self._begun, None
            if job is None:
                send(response, header)
                return
            job.add_done_callback(when_done(response, header))

        service.send_response = send_when_done

    def _execute(
        self, actor: Actor, request: ExecuteAction.Request, response: ExecuteAction.Response
    ) -> ExecuteAction.Response:
        self._begun = self._worker.submit(actor.value, lambda: self._run(actor, request))
        if self._begun is None:
            self._fill(response, MotionResult(Outcome.BUSY, BUSY))
        return response

    def _run(self, actor: Actor, request: ExecuteAction.Request) -> MotionResult:
        late = self._late(request)
        if late is not None:
            return late
        budget = self._get('motion_budget')
        return self.cell.run_action(
            actor, request.object, request.action, self._look, self._on_tick, budget
        )

    def _late(self, request: ExecuteAction.Request) -> MotionResult | None:
        expires, now = messages.nanoseconds(request.expires), self._now()
        if expires == 0 or now <= expires:
            return None
        late = (now - expires) * 1e-9
        return MotionResult(Outcome.EXPIRED, f'The request expired {late:.1f} s ago.')

    def _answer(
        self, response: ExecuteAction.Response, done: Future[MotionResult]
    ) -> ExecuteAction.Response:
        error = done.exception()
        if error is None:
            return self._fill(response, done.result())
        return self._fill(response, MotionResult(Outcome.HELD, f'The motion failed: {error}'))

    def _fill(
        self, response: ExecuteAction.Response, result: MotionResult
    ) -> ExecuteAction.Response:
        response.success = result.outcome is Outcome.COMPLETED
        response.outcome, response.message = int(result.outcome), result.message
        if result.started is not None and result.finished is not None:
            response.started = self._stamp(result.started)
            response.finished = self._stamp(result.finished)
        self._counts['motions' if result.started is not None else 'refused'] += 1
        if self.context.ok():
            self.get_logger().info(f'{result.outcome.name}: {result.message}')
        return response

    def _reset(
        self, request: ResetCell.Request, response: ResetCell.Response
    ) -> ResetCell.Response:
        if not self._worker.busy:
            self._begun = self._worker.submit('reset', lambda: self._set_up(request))
        response.message = RESET_BUSY
        return response

    def _answer_reset(
        self, response: ResetCell.Response, done: Future[None]
    ) -> ResetCell.Response:
        error = done.exception()
        response.success = error is None
        response.message = 'The table is set up.' if error is None else str(error)
        return response

    def _set_up(self, request: ResetCell.Request) -> None:
        self.cell.reset(list(request.objects), list(request.states), request.seed)
        self._reset_stamp, self._views = self._now(), {}
        self._pacer.restart(self.cell.time)

    def _hold(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.message = 'The cell was held already.' if self.cell.held else 'The cell is held.'
        self.cell.hold()
        response.success = True
        return response

    def _resume(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.message = 'Motion is allowed again.' if self.cell.held else 'Nothing was held.'
        was_held = self.cell.held
        self.cell.resume()
        self._to_tidy = was_held or self._to_tidy
        response.success = True
        return response

    def _on_table_state(self, message: TableState) -> None:
        stamp = messages.nanoseconds(message.header.stamp)
        try:
            views = messages.object_views(message)
        except ValueError as error:
            self._counts['table_states_dropped'] += 1
            self.get_logger().warning(str(error), throttle_duration_sec=5.0)
            return
        if stamp > self._reset_stamp:
            self._views, self._views_stamp = views, stamp

    def _look(self, name: str) -> ObjectView | None:
        age = (self._now() - self._views_stamp) * 1e-9
        return self._views.get(name) if age <= self._get('table_state_timeout') else None

    def _now(self) -> int:
        """Simulated time, ns since the epoch."""
        return self._epoch + round(self.cell.time * 1e9)

    def _stamp(self, cell_time: float) -> Any:
        return messages.time_message(self._epoch + round(cell_time * 1e9))

    def _idle(self) -> None:
        """Between motions: let time pass up to the next frame, or clear the table after a hold."""
        if self._to_tidy and not self.cell.held:
            self._to_tidy = False
            self.cell.tidy_up(self._on_tick)
        for _ in range(self._steps_per_frame):
            self.cell.step()
            self._publish_due()
        # Idling knows no "as fast as it goes".
        self._pacer.wait(self.cell.time, self._get('real_time_factor') or 1.0)

    def _on_idle_error(self, error: Exception) -> None:
        if self.context.ok():
            self.get_logger().error(f'The cell stumbled: {error}', throttle_duration_sec=5.0)

    def _on_tick(self) -> None:
        """After every physics step of a motion."""
        if not self.context.ok():
            self.cell.hold()
            return
        self._publish_due()
        self._pacer.wait(self.cell.time, self._get('real_time_factor'))

    def _publish_due(self) -> None:
        if not self.context.ok():
            return
        steps = self.cell.world.steps
        if steps % STEPS_PER_CLOCK == 0 and self._get('publish_clock'):
            self._clock_publisher.publish(ClockMessage(clock=self._stamp(self.cell.time)))
        if steps % self._steps_per_frame == 0:
            stamp = self._stamp(self.cell.time)
            self._joints.publish(messages.joint_state_message(self.cell.arm, stamp))
            self._publish_frame(stamp)

    def _publish_frame(self, stamp: Any) -> None:
        publishers = (self._info, self._rgb, self._depth)
        if not any(publisher.get_subscription_count() for publisher in publishers):
            return
        images = self.cell.frame()
        rgb = messages.image_message(images.rgb, 'rgb8')
        depth = messages.image_message(images.depth_mm, '16UC1')
        for publisher, message in zip(publishers, (self._info_message, rgb, depth), strict=True):
            message.header.stamp = stamp
            message.header.frame_id = messages.CAMERA_FRAME
            publisher.publish(message)
        self._counts['frames'] += 1

    def _diagnose(self) -> None:
        state = 'moving' if self._worker.busy else 'idle'
        status = DiagnosticStatus(
            level=DiagnosticStatus.WARN if self.cell.held else DiagnosticStatus.OK,
            name='arm_driver',
            message='held' if self.cell.held else state,
            hardware_id='simulated cell',
        )
        age = (self._now() - self._views_stamp) * 1e-9 if self._views_stamp else float('inf')
        values = {**self._counts, 'table_state_age_s': f'{age:.2f}'}
        status.values = [KeyValue(key=key, value=str(value)) for key, value in values.items()]
        array = DiagnosticArray(status=[status])
        array.header.stamp = self._stamp(self.cell.time)
        self._diagnostics.publish(array)


def main() -> None:
    """Run the node until it is interrupted."""
    # Images this small gain nothing from OpenCV's threads, and on a busy machine their waiting for
    # each other costs up to ten times the frame.
    cv2.setNumThreads(1)
    rclpy.init()
    node: ArmDriverNode | None = None
    executor = SingleThreadedExecutor()
    try:
        node = ArmDriverNode()
        executor.add_node(node)
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except RCLError:
        # The executor's threads may meet a context that a signal has just shut down.
        if rclpy.ok():
            raise
    except (ValueError, InvalidParameterValueException) as error:
        sys.exit(f'arm_driver: {error}')
    finally:
        if node is not None:
            node.stop()
        executor.shutdown()
        if node is not None:
            node.destroy_node()
        rclpy.try_shutdown()


if __name__ == '__main__':
    main()

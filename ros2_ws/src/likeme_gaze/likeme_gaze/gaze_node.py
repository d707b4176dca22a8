"""The node that follows a mentor's gaze: what it looks at, and how to look there too."""

from __future__ import annotations

import signal
import sys
import time
from collections import Counter
from typing import Any

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped
from rcl_interfaces.msg import SetParametersResult
from rclpy.clock import Clock, ClockType
from rclpy.exceptions import ParameterException
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.signals import SignalHandlerOptions
from trajectory_msgs.msg import JointTrajectory
from visualization_msgs.msg import MarkerArray

from likeme_gaze import GazeModel
from likeme_gaze.mentor import messages
from likeme_gaze.mentor.refusals import Refusals
from likeme_gaze.mentor.sentences import goal_found, learned, mentor_met
from likeme_gaze.mentor.settings import PARAMETERS, GazeSettings, Learning, read_settings
from likeme_gaze.mentor.watch import Answer, MentorWatch
from likeme_inference.messages import diagnostics_message, stamp_ns
from likeme_msgs.msg import FixationDistance

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
#: s at most until a signal is noticed, and for which a refusal is worth a warning.
SIGNAL_PERIOD = 0.2
RECENT = 10.0


class GazeNode(Node):
    """Infers what a mentor looks at from its head's poses, and turns the robot's head there.

    One trial is a start pose, then `observations` head poses: each the head at rest after it has
    turned from there to its goal, not a stream.

    | subscribes | type, each reliable, depth 10 | |
    | --- | --- | --- |
    | mentor/head_pose/start | geometry_msgs/PoseStamped | the head before it moves |
    | mentor/head_pose | geometry_msgs/PoseStamped | the head after a turn: one observation |
    | mentor/fixation_distance | likeme_msgs/FixationDistance | with use_distance, of its stamp |

    Head poses are in base_frame or mentor_frame, x along the line of sight, m.

    | publishes | type, reliable | |
    | --- | --- | --- |
    | mentor/goal | geometry_msgs/PoseWithCovarianceStamped, transient local | posterior of the
      goal in base_frame after each observation, m |
    | head_command | trajectory_msgs/JointTrajectory, volatile | the neck's angle, rad, once a
      trial, after the last observation |
    | gaze_markers | visualization_msgs/MarkerArray, transient local | lines of sight, the goal
      and its 95 % ellipse, after each start pose and observation |
    | /diagnostics | diagnostic_msgs/DiagnosticArray | 1 Hz, refusals by reason |

    All carry the stamp of the head pose they come from. Parameters: mentor.settings.PARAMETERS. A
    change counts from the next start pose on; one of the self-experience has the robot learn anew.
    """

    def __init__(self) -> None:
        super().__init__('gaze_node')
        for name, parameter in PARAMETERS.items():
            descriptor = messages.parameter_descriptor(parameter)
            self.declare_parameter(name, parameter.default, descriptor)
        self._settings = read_settings(self._values([]))
        self._model = self._learn(self._settings.learning)
        self._proposed: tuple[GazeSettings, GazeModel] | None = None
        self._watch = MentorWatch(self._model, self._settings.watching)
        self._refusals = Refusals()
        self._counts: Counter[str] = Counter()
        self._goal_pub = self.create_publisher(PoseWithCovarianceStamped, 'mentor/goal', LATCHED)
        self._command_pub = self.create_publisher(JointTrajectory, 'head_command', 1)
        self._marker_pub = self.create_publisher(MarkerArray, 'gaze_markers', LATCHED)
        self._diagnostics_pub = self.create_publisher(DiagnosticArray, '/diagnostics', 10)
        self.create_subscription(PoseStamped, 'mentor/head_pose/start', self._on_start, 10)
        self.create_subscription(PoseStamped, 'mentor/head_pose', self._on_head_pose, 10)
        self.create_subscription(
            FixationDistance, 'mentor/fixation_distance', self._on_distance, 10
        )
        self.add_on_set_parameters_callback(self._check_parameters)
        self.add_post_set_parameters_callback(self._apply_parameters)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(1.0, self._publish_diagnostics, clock=steady)

    def _values(self, changes: list[Parameter]) -> dict[str, Any]:
        """All parameters after some changes."""
        values = {name: self.get_parameter(name).value for name in PARAMETERS}
        return values | {p.name: p.value for p in changes if p.name in PARAMETERS}

    def _learn(self, learning: Learning) -> GazeModel:
        began = time.monotonic()
        model = learning.model()
        self.get_logger().info(learned(learning, time.monotonic() - began))
        return model

    def _check_parameters(self, changes: list[Parameter]) -> SetParametersResult:
        self._proposed = None
        try:
            settings = read_settings(self._values(changes))
            anew = settings.learning != self._settings.learning
            self._proposed = settings, self._learn(settings.learning) if anew else self._model
        except (ValueError, TypeError) as error:
            self.get_logger().warning(f'Parameters refused: {error}')
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _apply_parameters(self, changes: list[Parameter]) -> None:
        if self._proposed is None:
            return
        (self._settings, self._model), self._proposed = self._proposed, None
        self._watch = MentorWatch(self._model, self._settings.watching)
        changed = ', '.join(f'{p.name} = {p.value!r}' for p in changes)
        self.get_logger().info(f'From the next start pose on: {changed}.')

    def _on_start(self, msg: PoseStamped) -> None:
        try:
            answer = self._watch.start(messages.head_pose(msg, self._now()))
        except ValueError as error:
            self._refuse(error)
            return
        self._counts['mentors'] += 1
        self.get_logger().info(mentor_met(answer, self._settings.watching))
        self._publish(answer)

    def _on_head_pose(self, msg: PoseStamped) -> None:
        try:
            answer = self._watch.observe(messages.head_pose(msg, self._now()))
        except ValueError as error:
            self._refuse(error)
            return
        self._publish(answer)

    def _on_distance(self, msg: FixationDistance) -> None:
        try:
            answer = self._watch.measure(stamp_ns(msg.header.stamp), msg.distance)
        except ValueError as error:
            self._refuse(error)
            return
        self._publish(answer)

    def _publish(self, answer: Answer | None) -> None:
        """Publish what is believed, and after the last observation turn the head."""
        if answer is None:
            return
        frame, settings = self._settings.watching.frames.base, self._settings
        self._marker_pub.publish(messages.markers_msg(answer, frame))
        if answer.goal is None:
            return
        self._counts['observations'] += 1
        self._goal_pub.publish(messages.goal_msg(answer, frame))
        if answer.turn:
            self._counts['head commands'] += 1
            self.get_logger().info(goal_found(answer))
            self._command_pub.publish(
                messages.command_msg(answer, frame, settings.head_joint, settings.turn_time)
            )

    def _refuse(self, error: ValueError) -> None:
        said = self._refusals.add(error, time.monotonic())
        if said is not None:
            self.get_logger().warning(said)

    def _now(self) -> int:
        return int(self.get_clock().now().nanoseconds)

    def _publish_diagnostics(self) -> None:
        refused = self._refusals.recent(time.monotonic(), RECENT)
        learning = self._settings.learning
        facts = {
            'training points': learning.points,
            'seed': learning.seed,
            'blindfold experience': str(learning.blindfold),
            'observations of this mentor': self._watch.observations,
            **self._counts,
            **{f'refused: {reason}': n for reason, n in sorted(self._refusals.counts.items())},
        }
        said = 'head poses were refused just now' if refused else ''
        self._diagnostics_pub.publish(
            diagnostics_message(
                'gaze_node: gaze following', said, facts, self.get_clock().now().to_msg()
            )
        )


def main() -> int:
    """Run the node until SIGINT or SIGTERM.

    A signal is only noted, so that a callback comes to its end before the context is shut down.
    """
    signals: list[int] = []
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda received, _: signals.append(received))
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    try:
        node = GazeNode()
    except (ValueError, TypeError, ParameterException) as error:
        print(f'gaze_node does not start: {error}', file=sys.stderr)  # noqa: T201
        rclpy.try_shutdown()
        return 1
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    try:
        while not signals:
            executor.spin_once(timeout_sec=SIGNAL_PERIOD)
    finally:
        executor.shutdown()
        node.destroy_node()
        rclpy.try_shutdown()
    return 0


if __name__ == '__main__':
    sys.exit(main())

"""Node that infers what a mentor looks at and turns the robot's head there."""

from __future__ import annotations

import sys
import time
from collections import Counter

from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped
from rcl_interfaces.msg import SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter
from trajectory_msgs.msg import JointTrajectory
from visualization_msgs.msg import MarkerArray

from likeme_core.heartbeats import NodeState, described
from likeme_core.ros import parameters
from likeme_core.ros.diagnostics import DiagnosticsPublisher, diagnostics_msg
from likeme_core.ros.heartbeat import HeartbeatPublisher
from likeme_core.ros.qos import LATCHED
from likeme_core.ros.spin import run_node
from likeme_core.ros.time import stamp_ns, steady_clock
from likeme_gaze import GazeModel
from likeme_gaze.mentor import messages
from likeme_gaze.mentor.log_messages import goal_inferred, mentor_detected, model_trained
from likeme_gaze.mentor.mentor_tracker import GazeEstimate, MentorTracker
from likeme_gaze.mentor.rejections import RejectionCounter
from likeme_gaze.mentor.settings import SETTINGS, GazeSettings, LearningSettings, read_settings
from likeme_msgs.msg import FixationDistance

#: s after a rejected input in which /diagnostics reports a warning.
REJECTION_WARNING = 10.0


class GazeNode(Node):
    """Infers a mentor's gaze target from its head poses and turns the robot's head there.

    One trial is a start pose, then `observations` head poses: each the head at rest after a turn
    from the start pose to the goal, not a stream.

    | subscribes | type, each reliable, depth 10 | |
    | --- | --- | --- |
    | mentor/head_pose/start | geometry_msgs/PoseStamped | the head before it moves |
    | mentor/head_pose | geometry_msgs/PoseStamped | the head after a turn: one observation |
    | mentor/fixation_distance | likeme_msgs/FixationDistance | if use_distance, same stamp |

    Head poses are given in base_frame or mentor_frame, x along the line of sight, m.

    | publishes | type, reliable | |
    | --- | --- | --- |
    | mentor/goal | geometry_msgs/PoseWithCovarianceStamped, transient local | posterior of the
      goal in base_frame after each observation, m |
    | head_command | trajectory_msgs/JointTrajectory, volatile | the neck angle, rad, once per
      trial, after the last observation |
    | gaze_markers | visualization_msgs/MarkerArray, transient local | lines of sight, the goal
      and its 95 % ellipse, after each start pose and observation |
    | /diagnostics | diagnostic_msgs/DiagnosticArray | 1 Hz, rejected inputs by reason |
    | heartbeat | likeme_msgs/Heartbeat, best effort | 20 Hz, once trained; none while it is
      trained again, DEGRADED after rejected inputs |

    All carry the stamp of the head pose they follow from. Parameters: mentor.settings.SETTINGS.
    Changes apply from the next start pose on; a change of the self-experience trains the model
    again.
    """

    def __init__(self) -> None:
        super().__init__('gaze_node')
        parameters.declare(self, SETTINGS)
        self._settings = read_settings(parameters.values(self, SETTINGS))
        self._model = self._train(self._settings.learning)
        self._proposed: tuple[GazeSettings, GazeModel] | None = None
        self._tracker = MentorTracker(self._model, self._settings.tracking)
        self._rejections = RejectionCounter()
        self._counts: Counter[str] = Counter()
        self._goal_pub = self.create_publisher(PoseWithCovarianceStamped, 'mentor/goal', LATCHED)
        self._command_pub = self.create_publisher(JointTrajectory, 'head_command', 1)
        self._marker_pub = self.create_publisher(MarkerArray, 'gaze_markers', LATCHED)
        self._diagnostics_pub = DiagnosticsPublisher(self)
        self.create_subscription(PoseStamped, 'mentor/head_pose/start', self._on_start, 10)
        self.create_subscription(PoseStamped, 'mentor/head_pose', self._on_head_pose, 10)
        self.create_subscription(
            FixationDistance, 'mentor/fixation_distance', self._on_distance, 10
        )
        self.add_on_set_parameters_callback(self._check_parameters)
        self.add_post_set_parameters_callback(self._apply_parameters)
        self.create_timer(1.0, self._publish_diagnostics, clock=steady_clock())
        self._heartbeat = HeartbeatPublisher(self, self._state)

    def _train(self, learning: LearningSettings) -> GazeModel:
        started = time.monotonic()
        model = learning.model()
        self.get_logger().info(model_trained(learning, time.monotonic() - started))
        return model

    def _check_parameters(self, changes: list[Parameter]) -> SetParametersResult:
        self._proposed = None
        try:
            settings = read_settings(parameters.values(self, SETTINGS, changes))
            retrain = settings.learning != self._settings.learning
            self._proposed = settings, self._train(settings.learning) if retrain else self._model
        except (ValueError, TypeError) as error:
            self.get_logger().warning(f'Parameters refused: {error}')
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _apply_parameters(self, changes: list[Parameter]) -> None:
        if self._proposed is None:
            return
        (self._settings, self._model), self._proposed = self._proposed, None
        self._tracker = MentorTracker(self._model, self._settings.tracking)
        changed = ', '.join(f'{p.name} = {p.value!r}' for p in changes)
        self.get_logger().info(f'From the next start pose on: {changed}.')

    def _on_start(self, msg: PoseStamped) -> None:
        try:
            estimate = self._tracker.start(messages.head_pose(msg, self._now()))
        except ValueError as error:
            self._reject(error)
            return
        self._counts['mentors'] += 1
        self.get_logger().info(mentor_detected(estimate, self._settings.tracking))
        self._publish(estimate)

    def _on_head_pose(self, msg: PoseStamped) -> None:
        try:
            estimate = self._tracker.observe(messages.head_pose(msg, self._now()))
        except ValueError as error:
            self._reject(error)
            return
        self._publish(estimate)

    def _on_distance(self, msg: FixationDistance) -> None:
        try:
            estimate = self._tracker.observe_distance(stamp_ns(msg.header.stamp), msg.distance)
        except ValueError as error:
            self._reject(error)
            return
        self._publish(estimate)

    def _publish(self, estimate: GazeEstimate | None) -> None:
        """Publish the estimate, and after the last observation the head command."""
        if estimate is None:
            return
        frame, settings = self._settings.tracking.frames.base, self._settings
        self._marker_pub.publish(messages.markers_msg(estimate, frame))
        if estimate.goal is None:
            return
        self._counts['observations'] += 1
        self._goal_pub.publish(messages.goal_msg(estimate, frame))
        if estimate.turn:
            self._counts['head commands'] += 1
            self.get_logger().info(goal_inferred(estimate))
            self._command_pub.publish(
                messages.command_msg(estimate, frame, settings.head_joint, settings.turn_time)
            )

    def _reject(self, error: ValueError) -> None:
        message = self._rejections.add(error, time.monotonic())
        if message is not None:
            self.get_logger().warning(message)

    def _now(self) -> int:
        return int(self.get_clock().now().nanoseconds)

    def _state(self) -> tuple[NodeState, str]:
        if self._rejections.recent(time.monotonic(), REJECTION_WARNING):
            return NodeState.DEGRADED, 'inputs were refused recently'
        return NodeState.READY, ''

    def _publish_diagnostics(self) -> None:
        state, message = self._state()
        learning = self._settings.learning
        facts = {
            'training points': learning.points,
            'seed': learning.seed,
            'blindfold experience': str(learning.blindfold),
            'observations of this mentor': self._tracker.observations,
            'health': described(state, message),
            **self._counts,
            **{f'refused: {reason}': n for reason, n in sorted(self._rejections.counts.items())},
        }
        level = DiagnosticStatus.WARN if message else DiagnosticStatus.OK
        now = self.get_clock().now().to_msg()
        self._diagnostics_pub.publish(
            diagnostics_msg('gaze_node: gaze following', level, message or 'ready', facts, now)
        )


def main() -> int:
    """Run the node until SIGINT or SIGTERM."""
    return run_node('gaze_node', GazeNode)


if __name__ == '__main__':
    sys.exit(main())

"""The node that follows a mentor's gaze: what it looks at, and how to look there too."""

from __future__ import annotations

import sys
import time
from collections import Counter

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped
from rcl_interfaces.msg import SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter
from trajectory_msgs.msg import JointTrajectory
from visualization_msgs.msg import MarkerArray

from likeme_core.ros import parameters
from likeme_core.ros.diagnostics import diagnostics_msg
from likeme_core.ros.qos import LATCHED
from likeme_core.ros.spin import run_node
from likeme_core.ros.time import stamp_ns, steady_clock
from likeme_gaze import GazeModel
from likeme_gaze.mentor import messages
from likeme_gaze.mentor.refusals import Refusals
from likeme_gaze.mentor.sentences import goal_found, learned, mentor_met
from likeme_gaze.mentor.settings import SETTINGS, GazeSettings, Learning, read_settings
from likeme_gaze.mentor.watch import Answer, MentorWatch
from likeme_msgs.msg import FixationDistance

#: s for which a refusal is worth a warning.
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

    All carry the stamp of the head pose they come from. Parameters: mentor.settings.SETTINGS. A
    change counts from the next start pose on; one of the self-experience has the robot learn anew.
    """

    def __init__(self) -> None:
        super().__init__('gaze_node')
        parameters.declare(self, SETTINGS)
        self._settings = read_settings(parameters.values(self, SETTINGS))
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
        self.create_timer(1.0, self._publish_diagnostics, clock=steady_clock())

    def _learn(self, learning: Learning) -> GazeModel:
        began = time.monotonic()
        model = learning.model()
        self.get_logger().info(learned(learning, time.monotonic() - began))
        return model

    def _check_parameters(self, changes: list[Parameter]) -> SetParametersResult:
        self._proposed = None
        try:
            settings = read_settings(parameters.values(self, SETTINGS, changes))
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
        level = DiagnosticStatus.WARN if refused else DiagnosticStatus.OK
        said = 'head poses were refused just now' if refused else 'ready'
        now = self.get_clock().now().to_msg()
        self._diagnostics_pub.publish(
            diagnostics_msg('gaze_node: gaze following', level, said, facts, now)
        )


def main() -> int:
    """Run the node until SIGINT or SIGTERM."""
    return run_node('gaze_node', GazeNode)


if __name__ == '__main__':
    sys.exit(main())

"""The gaze node as a real process: trials, bad input, parameters, signals."""

from __future__ import annotations

import math
import signal
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped
from head_poses import TO_LEFT, TO_RIGHT, head, message, settings
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter
from trajectory_msgs.msg import JointTrajectory
from visualization_msgs.msg import MarkerArray

from graph import LATCHED, Graph, NodeProcess
from in_process import refusal
from likeme_core.heartbeats import NodeState
from likeme_core.ros.heartbeat import HeartbeatSubscriber
from likeme_gaze.gaze_node import main
from likeme_gaze.mentor import messages
from likeme_gaze.mentor.head_pose import HeadPose
from likeme_gaze.mentor.mentor_tracker import MentorTracker
from likeme_msgs.msg import FixationDistance

pytestmark = pytest.mark.graph
NODE = 'likeme_gaze.gaze_node'
POINTS = 60


class Mentor:
    """Publishes head poses to the gaze node and collects its messages."""

    def __init__(self, graph: Graph, **parameters: Any) -> None:
        self.process: NodeProcess = graph.start(NODE, **{'training_points': POINTS} | parameters)
        self._graph = graph
        self.start_pub = graph.publisher(PoseStamped, 'mentor/head_pose/start')
        self.pose_pub = graph.publisher(PoseStamped, 'mentor/head_pose')
        self.distance_pub = graph.publisher(FixationDistance, 'mentor/fixation_distance')
        self.goals = graph.collect(PoseWithCovarianceStamped, 'mentor/goal', LATCHED)
        self.commands = graph.collect(JointTrajectory, 'head_command')
        self.markers = graph.collect(MarkerArray, 'gaze_markers', LATCHED)
        self.diagnostics = graph.collect(DiagnosticArray, '/diagnostics')

    def start(self, pose: HeadPose) -> None:
        """Publish a start pose and wait for its markers."""
        drawn = len(self.markers)
        self.start_pub.publish(message(pose))
        self._graph.until(lambda: len(self.markers) > drawn, 10, 'markers of the start pose')

    def observe(self, pose: HeadPose) -> None:
        """Publish a head pose and wait for the goal: of several at once only the last is kept."""
        before = len(self.goals)
        self.pose_pub.publish(message(pose))
        self._graph.until(lambda: len(self.goals) > before, 10, 'a goal')

    def look(self, angle: float, begin: float, count: int = 5) -> JointTrajectory:
        """Publish a whole trial; the head command."""
        self.commands.clear()
        self.start(head(begin))
        for k in range(1, count + 1):
            self.observe(head(begin + k, angle))
        return self._graph.until(lambda: self.commands, 10, 'a head command')[0]

    def facts(self) -> dict[str, str]:
        """The newest diagnostics."""
        if not self.diagnostics:
            return {}
        return {item.key: item.value for item in self.diagnostics[-1].status[0].values}


def expected(angle: float, **changes: Any) -> Any:
    """The library's estimate for the same trial."""
    chosen = settings(training_points=POINTS, **changes)
    tracker = MentorTracker(chosen.learning.model(), chosen.tracking)
    tracker.start(head(100))
    return [tracker.observe(head(100 + k, angle)) for k in range(1, 6)][-1]


def set_parameters(graph: Graph, **values: Any) -> Any:
    wanted = [Parameter(name, value=value).to_parameter_msg() for name, value in values.items()]
    request = SetParameters.Request(parameters=wanted)
    return graph.call(SetParameters, 'gaze_node/set_parameters', request).results[0]


def test_published_goals_equal_those_of_the_library(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        mentor = Mentor(graph)
        left = mentor.look(TO_LEFT, 100)
        right = mentor.look(TO_RIGHT, 200)
        graph.until(lambda: mentor.facts().get('head commands') == '2', 10, 'diagnostics')

        for command, goal, angle in (
            (left, mentor.goals[4], TO_LEFT),
            (right, mentor.goals[9], TO_RIGHT),
        ):
            answer = expected(angle)
            wanted = messages.goal_msg(answer, 'base_link').pose
            np.testing.assert_allclose(
                goal.pose.covariance, wanted.covariance, rtol=1e-6, atol=1e-9
            )
            assert goal.pose.pose.position.x == pytest.approx(wanted.pose.position.x)
            assert goal.pose.pose.position.y == pytest.approx(wanted.pose.position.y)
            assert command.points[0].positions[0] == pytest.approx(answer.neck[0])
            assert command.header == goal.header
        assert [goal.header.stamp.sec for goal in mentor.goals[:5]] == [101, 102, 103, 104, 105]
        assert len(mentor.commands) == 1
        assert mentor.diagnostics[-1].status[0].level == b'\x00'
        late = graph.collect(PoseWithCovarianceStamped, 'mentor/goal', LATCHED)
        late_commands = graph.collect(JointTrajectory, 'head_command', LATCHED.depth)
        graph.until(lambda: late, 10, 'the last goal for a late subscriber')
        assert late == mentor.goals[-1:]
        assert late_commands == []
        assert mentor.process.stop() == 0
        assert 'Traceback' not in mentor.process.said
        assert 'Trained on 60 simulated head movements' in mentor.process.said


BAD_STARTS = {
    'unknown frame': (head(50, frame='map'), "in base_link or mentor, got 'map'"),
    'not finite': (head(50, place=(math.nan, 0, 0)), 'got (nan, 0, 0)'),
    'quaternion': (head(50, orientation=(0, 0, 0, 0)), 'of norm 1 within 0.01, got 0.'),
    'no heading': (head(50, orientation=(0, 0.5**0.5, 0, 0.5**0.5)), 'straight up or down'),
    'not usable': (head(50, place=(0.05, 0, 0)), 'at least 10 cm from the agent, got 5.0 cm.'),
}
BAD_POSES = {
    'unknown frame': (head(101, frame='map'), 'unknown frame'),
    'not finite': (head(101, orientation=(0, 0, math.inf, 1)), 'got (0, 0, inf, 1)'),
    'quaternion': (head(101, orientation=(0, 0, 0.6, 0.9)), 'got 1.082.'),
    'stamp': (head(99), 'after that of the last head pose, 100.000 s, got 99.000 s.'),
    'not usable': (head(101, place=(6.5, 0, 1)), 'within 30 cm of its start place, got 50.0 cm.'),
}


def test_invalid_inputs_are_counted_and_change_nothing(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        nodes = HeartbeatSubscriber(graph.node).monitor.nodes
        mentor = Mentor(graph)
        graph.until(lambda: '/gaze_node' in nodes, 10, 'a heartbeat')
        assert nodes['/gaze_node'].state is NodeState.READY
        mentor.pose_pub.publish(message(head(1)))
        graph.until(lambda: mentor.facts().get('refused: no start pose') == '1', 10, 'a rejection')
        for pose, _ in BAD_STARTS.values():
            mentor.start_pub.publish(message(pose))
        graph.until(lambda: mentor.facts().get('refused: not usable') == '1', 10, 'rejections')
        assert mentor.diagnostics[-1].status[0].level == b'\x01'
        assert mentor.facts()['health'] == 'degraded: inputs were refused recently'
        assert nodes['/gaze_node'].state is NodeState.DEGRADED
        assert mentor.markers == []

        mentor.start(head(100))
        for pose, _ in BAD_POSES.values():
            mentor.pose_pub.publish(message(pose))
        graph.until(lambda: mentor.facts().get('refused: not usable') == '2', 10, 'rejections')
        facts = mentor.facts()
        assert {k: v for k, v in facts.items() if k.startswith('refused')} == {
            'refused: no heading': '1', 'refused: no start pose': '1', 'refused: not finite': '2',
            'refused: not usable': '2', 'refused: quaternion': '2', 'refused: stamp': '1',
            'refused: unknown frame': '2',
        }  # fmt: skip
        assert (mentor.goals, mentor.commands) == ([], [])

        # The trial goes on, and rejected poses have not changed its result.
        for k in range(5):
            mentor.observe(head(102 + k, TO_LEFT))
        mentor.pose_pub.publish(message(head(107, TO_LEFT)))
        graph.until(lambda: mentor.facts().get('refused: enough seen') == '1', 10, 'a rejection')
        assert len(mentor.goals) == 5
        (command,) = mentor.commands
        assert command.points[0].positions[0] == pytest.approx(expected(TO_LEFT).neck[0])
        said = mentor.process.said
        for _, why in BAD_STARTS.values():
            assert why in said
        assert 'Expected a mentor/head_pose/start before the first mentor/head_pose' in said
        assert 'Expected 5 head poses after a start pose, got one more.' in said
        assert 'got 99.000 s' in said
        assert 'Traceback' not in said
        assert mentor.process.alive


def test_fixation_distances_reduce_the_goal_covariance(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        mentor = Mentor(graph, use_distance=True, observations=2)
        mentor.start(head(100))
        for second in (101, 102):
            measured = FixationDistance(distance=4.24)
            measured.header.stamp.sec = second
            mentor.distance_pub.publish(measured)
            mentor.observe(head(second, TO_LEFT))
        graph.until(lambda: mentor.commands, 10, 'a head command')

        place, covariance = mentor.goals[-1].pose.pose.position, mentor.goals[-1].pose.covariance
        assert (place.x, place.y) == pytest.approx((3.0, 3.0), abs=0.3)
        assert max(covariance[0], covariance[7]) < 0.3**2


def test_parameters_are_rejected_or_apply_from_the_next_start_pose(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        mentor = Mentor(graph)
        refused = [
            set_parameters(graph, **change)
            for change in (
                {'training_points': 3}, {'training_points': 2000}, {'prior_std': [1.0, -1.0]},
                {'blindfold_experience': 'wool'}, {'mentor_pose': [1.0]}, {'observations': 0},
                {'mentor_pose': 'near'}, {'mentor_frame': 'base_link'},
            )
        ]  # fmt: skip
        followed = mentor.look(TO_LEFT, 100).points[0].positions[0]
        accepted = [
            set_parameters(graph, mentor_blindfolded=True),
            set_parameters(graph, blindfold_experience='opaque'),
            set_parameters(graph, observations=3),
        ]
        mentor.goals.clear()
        still = mentor.look(TO_LEFT, 200, 3).points[0].positions[0]

        assert not any(result.successful for result in refused)
        assert refused[0].reason == 'Expected at least 5 training points, got 3.'
        assert refused[3].reason.endswith("got 'wool'.")
        assert all(result.successful for result in accepted)
        assert math.degrees(followed) > 30
        assert abs(math.degrees(still)) < 15
        assert len(mentor.goals) == 3


@pytest.mark.parametrize(
    ('parameters', 'why'),
    [
        ({'training_points': 3}, 'Expected at least 5 training points, got 3.'),
        ({'angle_noise': 0.0}, 'angle_noise'),
        ({'mentor_pose': []}, 'Expected mentor_pose as 3 finite numbers, got [None].'),
    ],
)
def test_a_node_with_bad_parameters_does_not_start(parameters: dict[str, Any], why: str) -> None:
    # The command line gaze says the same of a real process.
    assert why in refusal(main, 'gaze_node', **parameters)


def test_sigterm_during_head_poses_ends_the_node_cleanly(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        mentor = Mentor(graph)
        mentor.start(head(100))
        for k in range(200):
            mentor.pose_pub.publish(message(head(101 + k, TO_LEFT)))
        graph.until(lambda: mentor.goals, 10, 'a goal')
        mentor.process.signal(signal.SIGTERM)
        assert mentor.process.wait(10) == 0
        assert 'Traceback' not in mentor.process.said

"""The simulated mentor of gaze.sh: publishes head poses, receives the gaze node's answers."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import numpy as np
import rclpy
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.parameter_client import AsyncParameterClient
from rclpy.signals import SignalHandlerOptions
from trajectory_msgs.msg import JointTrajectory
from visualization_msgs.msg import MarkerArray

from likeme_core.interrupt import deferred_interrupt
from likeme_core.ros.heartbeat import HeartbeatPublisher
from likeme_core.ros.qos import LATCHED
from likeme_core.ros.time import stamp_ns, time_msg
from likeme_experiments.evaluation.mentor_trials import (
    GazeTrial,
    MentorScene,
    RobotResponse,
    scene_from,
)
from likeme_gaze import Gaussian, Pose2
from likeme_msgs.msg import FixationDistance

GAZE_NODE = 'gaze_node'
#: Height of the mentor's eyes, m.
EYE_HEIGHT = 1.2
#: s to wait for a running gaze node, and for one that is being started.
DISCOVERY_TIMEOUT, START_TIMEOUT = 8.0, 60.0
#: s to wait for the parameters and the answers to a head pose; to new parameters, which may make
#: the node learn again.
PARAMETER_TIMEOUT, ANSWER_TIMEOUT, LEARN_TIMEOUT = 8.0, 10.0, 60.0
POLL_PERIOD = 0.05


class GazeNodeError(Exception):
    """The gaze node is missing, or does not answer as expected."""


class MentorNode(Node):
    """Runs trials with a gaze node, one after another.

    Publishes: mentor/head_pose/start, mentor/head_pose, mentor/fixation_distance, heartbeat.
    Subscribes: mentor/goal, head_command, gaze_markers.
    Calls: gaze_node's parameter services.
    """

    def __init__(self, gaze_node: str, between_spins: Callable[[], None]) -> None:
        """gaze_node: its name. between_spins: called repeatedly while waiting; may raise."""
        super().__init__('gaze_mentor', start_parameter_services=False)
        self._gaze_node, self._between_spins = gaze_node, between_spins
        self._goals: dict[int, PoseWithCovarianceStamped] = {}
        self._commands: dict[int, JointTrajectory] = {}
        self._marker_stamps: set[int] = set()
        self._stamp = 0
        self._parameter_client = AsyncParameterClient(self, gaze_node)
        self._start_pub = self.create_publisher(PoseStamped, 'mentor/head_pose/start', 10)
        self._pose_pub = self.create_publisher(PoseStamped, 'mentor/head_pose', 10)
        self._distance_pub = self.create_publisher(
            FixationDistance, 'mentor/fixation_distance', 10
        )
        self._answers = (
            self.create_subscription(
                PoseWithCovarianceStamped, 'mentor/goal', self._on_goal, LATCHED
            ),
            self.create_subscription(JointTrajectory, 'head_command', self._on_command, 10),
            self.create_subscription(MarkerArray, 'gaze_markers', self._on_markers, LATCHED),
        )
        self._heartbeat = HeartbeatPublisher(self)
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self)

    def wait_until_ready(self, timeout: float) -> None:
        """Return when all topics and the parameter services of the gaze node are connected."""
        publishers = (self._start_pub, self._pose_pub, self._distance_pub)

        def connected() -> bool:
            subscribed = all(p.get_subscription_count() for p in publishers)
            published = all(s.get_publisher_count() for s in self._answers)
            return subscribed and published and self._parameter_client.services_are_ready()

        self._until(connected, timeout, f'{self._gaze_node} on {self._domain}')

    def scene(self) -> MentorScene:
        """Where robot and mentor are, by the gaze node's parameters."""
        names = ('base_frame', 'robot_head', 'mentor_pose', 'observations')
        values = self.gaze_parameters(names)
        return scene_from(*(values[name] for name in names))

    def gaze_parameters(self, names: tuple[str, ...]) -> dict[str, Any]:
        """Values of parameters of the gaze node."""
        future = self._parameter_client.get_parameters(list(names))
        self._until(future.done, PARAMETER_TIMEOUT, "the gaze node's parameters")
        values = [parameter_value_to_python(value) for value in future.result().values]
        return dict(zip(names, values, strict=True))

    def set_gaze_parameters(self, values: Mapping[str, Any]) -> None:
        """Set parameters of the gaze node; learning again takes it a second or more."""
        wanted = [Parameter(name, value=value) for name, value in values.items()]
        future = self._parameter_client.set_parameters_atomically(wanted)
        self._until(future.done, LEARN_TIMEOUT, 'an answer to new parameters')
        result = future.result().result
        if not result.successful:
            raise GazeNodeError(f'The gaze node refuses {dict(values)}: {result.reason}')

    @contextmanager
    def parameters_set(self, values: Mapping[str, Any]) -> Iterator[None]:
        """Set parameters, and restore them at the end if the gaze node is still running."""
        before = self.gaze_parameters(tuple(values))
        changed = {name: value for name, value in values.items() if before[name] != value}
        if changed:
            self.set_gaze_parameters(changed)
        try:
            yield
        finally:
            if changed and self._parameter_client.services_are_ready():
                self.set_gaze_parameters({name: before[name] for name in changed})

    def run_trial(self, scene: MentorScene, trial: GazeTrial) -> RobotResponse:
        """Publish one trial and wait for the inferred goal and the head command.

        Raises:
            GazeNodeError: no answer in time.
        """
        started = self._publish(self._start_pub, scene, trial.start)
        # Messages of two topics may change order: the first observation waits for the start.
        self._until(
            lambda: started in self._marker_stamps, ANSWER_TIMEOUT, 'gaze_markers of the start'
        )
        for pose, distance in trial.turns:
            stamp, goal = self._observe(scene, pose, distance)
        command = self._until(lambda: self._commands.get(stamp), ANSWER_TIMEOUT, 'a head_command')
        return RobotResponse(belief_of(goal), float(command.points[-1].positions[0]))

    def _observe(
        self, scene: MentorScene, pose: Pose2, distance: float
    ) -> tuple[int, PoseWithCovarianceStamped]:
        """Publish the head pose after a turn and wait for the goal; its stamp and the goal."""
        stamp = self._publish(self._pose_pub, scene, pose)
        measured = FixationDistance(distance=distance)
        measured.header.stamp = time_msg(stamp)
        self._distance_pub.publish(measured)
        goal = self._until(lambda: self._goals.get(stamp), ANSWER_TIMEOUT, 'a mentor/goal')
        return stamp, goal

    def _publish(self, publisher: Any, scene: MentorScene, pose: Pose2) -> int:
        """Publish a head pose with the next stamp; the stamp."""
        self._stamp = max(self._stamp + 1, int(self.get_clock().now().nanoseconds))
        msg = PoseStamped()
        msg.header.stamp, msg.header.frame_id = time_msg(self._stamp), scene.frame
        msg.pose.position.x, msg.pose.position.y = pose.x, pose.y
        msg.pose.position.z = EYE_HEIGHT
        msg.pose.orientation.z = math.sin(pose.heading / 2)
        msg.pose.orientation.w = math.cos(pose.heading / 2)
        publisher.publish(msg)
        return self._stamp

    def _until(self, condition: Callable[[], Any], timeout: float, what: str) -> Any:
        deadline = time.monotonic() + timeout
        while not (value := condition()):
            self._between_spins()
            self._check_single_node()
            if time.monotonic() > deadline:
                raise GazeNodeError(f'Expected {what} within {timeout:g} s, got nothing.')
            self._executor.spin_once(timeout_sec=POLL_PERIOD)
        return value

    @property
    def _domain(self) -> str:
        return f'ROS domain {self.context.get_domain_id()}'

    def _check_single_node(self) -> None:
        """Two gaze nodes would both answer; checked at every spin since discovery takes time."""
        nodes = self._start_pub.get_subscription_count()
        if nodes > 1:
            raise GazeNodeError(
                f'Expected one gaze node on {self._domain}, got {nodes}: use another domain, or '
                'the running node by --no-start.'
            )

    def _on_goal(self, msg: PoseWithCovarianceStamped) -> None:
        self._goals[stamp_ns(msg.header.stamp)] = msg

    def _on_command(self, msg: JointTrajectory) -> None:
        self._commands[stamp_ns(msg.header.stamp)] = msg

    def _on_markers(self, msg: MarkerArray) -> None:
        self._marker_stamps.update(stamp_ns(marker.header.stamp) for marker in msg.markers)


def belief_of(msg: PoseWithCovarianceStamped) -> Gaussian:
    """The goal in a message, m (2,)."""
    place = msg.pose.pose.position
    covariance = np.reshape(msg.pose.covariance, (6, 6))[:2, :2]
    return Gaussian(np.array([place.x, place.y]), covariance)


@contextmanager
def mentor(domain: int, gaze_node: str, alive: Callable[[], None]) -> Iterator[MentorNode]:
    """A simulated mentor on a ROS domain; Ctrl-C raises KeyboardInterrupt between two spins.

    alive: raises once the gaze node is known to have ended.
    """
    rclpy.init(domain_id=domain, signal_handler_options=SignalHandlerOptions.NO)
    with deferred_interrupt() as check:

        def between_spins() -> None:
            check()
            alive()

        node = MentorNode(gaze_node, between_spins)
        try:
            yield node
        finally:
            node.destroy_node()
            rclpy.try_shutdown()

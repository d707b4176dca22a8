"""The simulated mentor of gaze.sh as a node: shows trials to a gaze node, hears its answers."""

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
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.signals import SignalHandlerOptions
from trajectory_msgs.msg import JointTrajectory
from visualization_msgs.msg import MarkerArray

from likeme_core.interrupt import noted_interrupt
from likeme_core.ros.time import stamp_ns, time_msg
from likeme_experiments.gaze_trials import Reply, Scene, Trial, scene_from
from likeme_gaze import Gaussian, Pose2
from likeme_msgs.msg import FixationDistance

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
GAZE_NODE = 'gaze_node'
#: Of the mentor's eyes, m.
EYE_HEIGHT = 1.2
#: s to wait for a node that should be there, for one that is starting, for an answer, and for
#: parameters that have it learn anew.
PATIENCE, START_PATIENCE, ANSWER_PATIENCE, LEARN_PATIENCE = 8.0, 60.0, 10.0, 60.0
GLANCE = 0.05


class GazeNodeError(Exception):
    """The gaze node is not there, or does not answer as it should."""


class MentorNode(Node):
    """Shows a gaze node one trial after the other.

    Publishes: mentor/head_pose/start, mentor/head_pose, mentor/fixation_distance.
    Subscribes: mentor/goal, head_command, gaze_markers.
    Calls: gaze_node's parameter services.
    """

    def __init__(self, partner: str, alive: Callable[[], None]) -> None:
        """`partner` is the gaze node's name; `alive` raises once it is known to have ended."""
        super().__init__('gaze_mentor', start_parameter_services=False)
        self._partner, self._alive = partner, alive
        self._goals: dict[int, PoseWithCovarianceStamped] = {}
        self._commands: dict[int, JointTrajectory] = {}
        self._drawn: set[int] = set()
        self._stamp = 0
        self._parameters = AsyncParameterClient(self, partner)
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
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self)

    def wait_until_ready(self, patience: float) -> None:
        """Return when the gaze node is there, and all its topics are connected."""
        asked = (self._start_pub, self._pose_pub, self._distance_pub)

        def connected() -> bool:
            heard = all(p.get_subscription_count() for p in asked)
            answered = all(s.get_publisher_count() for s in self._answers)
            return heard and answered and self._parameters.services_are_ready()

        self._until(connected, patience, f'{self._partner} on {self._domain}')

    def scene(self) -> Scene:
        """Ask the gaze node where it and the mentor are."""
        names = ('base_frame', 'robot_head', 'mentor_pose', 'observations')
        told = self.parameters(names)
        return scene_from(*(told[name] for name in names))

    def parameters(self, names: tuple[str, ...]) -> dict[str, Any]:
        """Values of parameters of the gaze node."""
        future = self._parameters.get_parameters(list(names))
        self._until(future.done, PATIENCE, "the gaze node's parameters")
        values = [parameter_value_to_python(value) for value in future.result().values]
        return dict(zip(names, values, strict=True))

    def set_parameters(self, values: Mapping[str, Any]) -> None:
        """Set parameters of the gaze node; what makes it learn anew takes a second or more."""
        wanted = [Parameter(name, value=value) for name, value in values.items()]
        future = self._parameters.set_parameters_atomically(wanted)
        self._until(future.done, LEARN_PATIENCE, 'an answer to new parameters')
        result = future.result().result
        if not result.successful:
            raise GazeNodeError(f'The gaze node refuses {dict(values)}: {result.reason}')

    @contextmanager
    def parameters_set(self, values: Mapping[str, Any]) -> Iterator[None]:
        """Set parameters, and set them back at the end if the gaze node is still there."""
        before = self.parameters(tuple(values))
        changed = {name: value for name, value in values.items() if before[name] != value}
        if changed:
            self.set_parameters(changed)
        try:
            yield
        finally:
            if changed and self._parameters.services_are_ready():
                self.set_parameters({name: before[name] for name in changed})

    def show(self, scene: Scene, trial: Trial) -> Reply:
        """Show one trial and wait for what the robot infers and does.

        Raises:
            GazeNodeError: no answer in time.
        """
        started = self._publish(self._start_pub, scene, trial.start)
        # Topics are not ordered among one another: the first observation waits for the start.
        self._until(lambda: started in self._drawn, ANSWER_PATIENCE, 'gaze_markers of the start')
        for pose, distance in trial.turns:
            stamp, goal = self._observe(scene, pose, distance)
        command = self._until(lambda: self._commands.get(stamp), ANSWER_PATIENCE, 'a head_command')
        return Reply(belief_of(goal), float(command.points[-1].positions[0]))

    def _observe(
        self, scene: Scene, pose: Pose2, distance: float
    ) -> tuple[int, PoseWithCovarianceStamped]:
        """Show the head after a turn, and wait for the goal; the stamp and the goal."""
        stamp = self._publish(self._pose_pub, scene, pose)
        measured = FixationDistance(distance=distance)
        measured.header.stamp = time_msg(stamp)
        self._distance_pub.publish(measured)
        goal = self._until(lambda: self._goals.get(stamp), ANSWER_PATIENCE, 'a mentor/goal')
        return stamp, goal

    def _publish(self, publisher: Any, scene: Scene, pose: Pose2) -> int:
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
            self._alive()
            self._check_alone()
            if time.monotonic() > deadline:
                raise GazeNodeError(f'Expected {what} within {timeout:g} s, got nothing.')
            self._executor.spin_once(timeout_sec=GLANCE)
        return value

    @property
    def _domain(self) -> str:
        return f'ROS domain {self.context.get_domain_id()}'

    def _check_alone(self) -> None:
        """Two gaze nodes would both answer. Looked at all the time: discovery takes a while."""
        nodes = self._start_pub.get_subscription_count()
        if nodes > 1:
            raise GazeNodeError(
                f'Expected one gaze node on {self._domain}, got {nodes}: take another domain, or '
                'use the one that runs by --no-start.'
            )

    def _on_goal(self, msg: PoseWithCovarianceStamped) -> None:
        self._goals[stamp_ns(msg.header.stamp)] = msg

    def _on_command(self, msg: JointTrajectory) -> None:
        self._commands[stamp_ns(msg.header.stamp)] = msg

    def _on_markers(self, msg: MarkerArray) -> None:
        self._drawn.update(stamp_ns(marker.header.stamp) for marker in msg.markers)


def belief_of(msg: PoseWithCovarianceStamped) -> Gaussian:
    """The goal in a message, m (2,)."""
    place = msg.pose.pose.position
    covariance = np.reshape(msg.pose.covariance, (6, 6))[:2, :2]
    return Gaussian(np.array([place.x, place.y]), covariance)


@contextmanager
def mentor(domain: int, partner: str, alive: Callable[[], None]) -> Iterator[MentorNode]:
    """A simulated mentor on a ROS domain; Ctrl-C raises KeyboardInterrupt, so that it can tidy."""
    rclpy.init(domain_id=domain, signal_handler_options=SignalHandlerOptions.NO)
    with noted_interrupt() as check:

        def between_spins() -> None:
            check()
            alive()

        node = MentorNode(partner, between_spins)
        try:
            yield node
        finally:
            node.destroy_node()
            rclpy.try_shutdown()

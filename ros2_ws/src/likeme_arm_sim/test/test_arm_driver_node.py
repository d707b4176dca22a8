"""The arm driver as a real process on a ROS domain of its own."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from itertools import pairwise
from typing import Any

import pytest
from action_msgs.msg import GoalStatus
from domain_coordinator import domain_id
from geometry_msgs.msg import Point
from rclpy.action import ActionClient
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CameraInfo, Image
from std_srvs.srv import Trigger

from likeme_core.outcomes import MotionOutcome, ResetOutcome
from likeme_core.ros.time import stamp_ns, time_msg
from likeme_msgs.action import ExecuteAction as ExecuteActionAction
from likeme_msgs.msg import ObjectState, TableState, UnknownObject
from likeme_msgs.srv import ExecuteAction, MotionStatus, ResetCell

pytestmark = pytest.mark.graph
DRIVER = [sys.executable, '-m', 'likeme_arm_sim.arm_driver_node', '--ros-args']
KEEPER = [sys.executable, '-m', 'likeme_arm.hold_keeper_node']
FAST = ['-p', 'real_time_factor:=0.0', '-p', 'seed:=3']


class Client:
    """A node in this process that calls the driver and keeps what it publishes."""

    def __init__(self, domain: int) -> None:
        self.context = Context()
        self.context.init(domain_id=domain)
        self.node = Node('driver_test', context=self.context)
        self.kept: dict[str, list[Any]] = {}
        self.actions: dict[str, ActionClient] = {}
        self._changed = threading.Condition()
        self._keep(Clock, '/clock')
        self._keep(Image, 'camera/rgb/image_rect_color')
        self._keep(Image, 'camera/depth_registered/image_rect')
        self._keep(CameraInfo, 'camera/rgb/camera_info')
        self._keep(CameraInfo, 'camera/depth_registered/camera_info')
        self.table = self.node.create_publisher(TableState, 'table_state', 1)
        self._executor = SingleThreadedExecutor(context=self.context)
        self._executor.add_node(self.node)
        self._thread = threading.Thread(target=self._executor.spin, daemon=True)
        self._thread.start()

    def close(self) -> None:
        self._executor.shutdown()
        self._thread.join(5.0)
        for action in self.actions.values():
            action.destroy()
        self.node.destroy_node()
        self.context.try_shutdown()

    def _keep(self, kind: Any, topic: str) -> None:
        kept = self.kept.setdefault(topic, [])

        def on_message(message: Any) -> None:
            with self._changed:
                if kept and isinstance(message, Image):
                    # Pixels of the last image only: a minute of all of them is gigabytes.
                    kept[-1].data = []
                kept.append(message)
                self._changed.notify_all()

        self.node.create_subscription(kind, topic, on_message, 10)

    def wait_for(self, true: Callable[[], bool], seconds: float = 60.0) -> None:
        with self._changed:
            assert self._changed.wait_for(true, seconds)

    def wait_for_message(self, topic: str) -> None:
        count = len(self.kept[topic])
        self.wait_for(lambda: len(self.kept[topic]) > count)

    def start(self, kind: Any, name: str, **fields: Any) -> Any:
        client = self.node.create_client(kind, name)
        assert client.wait_for_service(60.0)
        return client.call_async(kind.Request(**fields))

    def call(self, kind: Any, name: str, **fields: Any) -> Any:
        return finished(self.start(kind, name, **fields))

    def act(self, who: str, name: str, action: str, **fields: Any) -> Any:
        service = f'{who}/execute_action'
        return self.call(ExecuteAction, service, object=name, action=action, **fields)

    @property
    def now(self) -> int:
        clocks = self.kept['/clock']
        return stamp_ns(clocks[-1].clock) if clocks else 0

    def show_chicken(
        self, y: float, frame: str = 'base_link', x: float = 0.44, unknown: Point | None = None
    ) -> None:
        stamp = time_msg(self.now)
        chicken = ObjectState(name='chicken', state=1, centroid=Point(x=x, y=y), last_seen=stamp)
        message = TableState(reference_frame=frame, objects=[chicken])
        if unknown is not None:
            message.unknown_objects = [UnknownObject(centroid=unknown, height=0.05)]
        message.header.stamp = stamp
        self.table.publish(message)


def finished(future: Any, seconds: float = 60.0) -> Any:
    done = threading.Event()
    future.add_done_callback(lambda _: done.set())
    assert done.wait(seconds)
    return future.result()


@pytest.fixture(scope='module')
def domain() -> Iterator[int]:
    with domain_id() as number:
        yield number


def start(domain: int, command: list[str]) -> subprocess.Popen[str]:
    env = os.environ | {'ROS_DOMAIN_ID': str(domain)}
    return subprocess.Popen(
        command, env=env, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )


def start_driver(domain: int, *arguments: str) -> subprocess.Popen[str]:
    return start(domain, [*DRIVER, *arguments])


@pytest.fixture(scope='module')
def client(domain: int) -> Iterator[Client]:
    processes = [start(domain, KEEPER), start_driver(domain, *FAST)]
    client = Client(domain)
    yield client
    client.close()
    for process in processes:
        process.send_signal(signal.SIGINT)
        out, _ = process.communicate(timeout=60)
        assert process.returncode == 0, out


@pytest.fixture(autouse=True)
def fresh(client: Client) -> None:
    client.call(Trigger, 'cell/resume')
    reset: Any = ResetCell.Response()
    deadline = time.monotonic() + 20
    while not reset.success and time.monotonic() < deadline:
        reset = client.call(ResetCell, 'cell/reset')
    assert reset.success, reset.message
    assert reset.outcome == ResetOutcome.COMPLETED


def test_frames_of_one_moment_share_a_stamp(client: Client) -> None:
    topics = [topic for topic in client.kept if topic.startswith('camera')]
    client.wait_for(lambda: all(len(client.kept[topic]) > 4 for topic in topics))
    stamps = [{stamp_ns(m.header.stamp) for m in client.kept[topic]} for topic in topics]
    assert len(set.intersection(*stamps)) >= 3
    rgb, depth, info, depth_info = (client.kept[topic][-1] for topic in topics)
    assert depth_info.k.tolist() == info.k.tolist()
    assert (rgb.encoding, depth.encoding) == ('rgb8', '16UC1')
    assert (rgb.width, rgb.height, info.width, info.height) == (640, 480, 640, 480)
    assert rgb.header.frame_id == depth.header.frame_id == 'camera_rgb_optical_frame'


def test_frames_come_at_the_cameras_rate_in_simulated_time(client: Client) -> None:
    kept = client.kept['camera/rgb/image_rect_color']
    begin = len(kept)
    client.wait_for(lambda: len(kept) > begin + 8)
    stamps = [stamp_ns(message.header.stamp) for message in kept[begin:]]
    gaps = {round((b - a) * 30 / 1e9) for a, b in pairwise(stamps)}
    assert gaps == {1}


def test_the_person_acts_and_a_second_request_is_refused_at_once(client: Client) -> None:
    first = client.start(
        ExecuteAction, 'human/execute_action', object='chicken', action='place_left'
    )
    client.wait_for(lambda: bool(client.kept['/clock']))
    began = client.now
    client.wait_for(lambda: client.now > began + 1_000_000_000)
    second = client.act('human', 'pear', 'place_left')
    assert second.outcome == MotionOutcome.BUSY
    reset = client.call(ResetCell, 'cell/reset')
    assert (reset.success, reset.outcome) == (False, ResetOutcome.BUSY)
    done = finished(first)
    assert done.success
    seconds = (stamp_ns(done.finished) - stamp_ns(done.started)) * 1e-9
    assert 3.0 < seconds < 7.0
    assert stamp_ns(second.started) == 0


def test_the_arm_goes_where_perception_says(client: Client) -> None:
    assert client.act('arm', 'chicken', 'push_left').outcome == MotionOutcome.OBJECT_NOT_SEEN
    outcome = MotionOutcome.OBJECT_NOT_SEEN
    deadline = time.monotonic() + 20
    while outcome == MotionOutcome.OBJECT_NOT_SEEN and time.monotonic() < deadline:
        client.show_chicken(y=-0.2)
        outcome = client.act('arm', 'chicken', 'push_left').outcome
    assert outcome == MotionOutcome.COMPLETED


def send_goal(client: Client, who: str, feedback: list[Any], **goal: Any) -> Any:
    """The handle of an accepted goal."""
    actions = client.actions.setdefault(
        who, ActionClient(client.node, ExecuteActionAction, f'{who}/execute_action')
    )
    assert actions.wait_for_server(60.0)
    sent = actions.send_goal_async(
        ExecuteActionAction.Goal(**goal), feedback_callback=lambda m: feedback.append(m.feedback)
    )
    handle = finished(sent)
    assert handle.accepted
    return handle


def test_the_action_is_the_service_with_feedback(client: Client) -> None:
    feedback: list[Any] = []
    goal = {'object': 'chicken', 'action': 'place_left', 'id': 'of-the-action'}
    answer = finished(send_goal(client, 'human', feedback, **goal).get_result_async())
    result = answer.result
    assert (answer.status, result.outcome) == (
        GoalStatus.STATUS_SUCCEEDED, MotionOutcome.COMPLETED
    )  # fmt: skip
    assert result.id == 'of-the-action'
    assert {each.phase for each in feedback} >= {'move'}
    elapsed = [each.elapsed for each in feedback]
    assert elapsed == sorted(elapsed)
    assert 0.0 < elapsed[-1] <= (stamp_ns(result.finished) - stamp_ns(result.started)) * 1e-9 + 1
    status = client.call(MotionStatus, 'human/motion_status', id='of-the-action').motion
    assert status.outcome == MotionOutcome.COMPLETED
    # Exactly once, whichever way it is asked for again.
    again = finished(send_goal(client, 'human', [], **goal).get_result_async())
    assert (again.status, again.result.outcome) == (
        GoalStatus.STATUS_ABORTED, MotionOutcome.REPEATED
    )  # fmt: skip
    assert client.call(ExecuteAction, 'human/execute_action', **goal).outcome == (
        MotionOutcome.REPEATED
    )


def test_a_cancelled_goal_is_held_and_no_other(client: Client) -> None:
    feedback: list[Any] = []
    handle = send_goal(client, 'human', feedback, object='chicken', action='place_left')
    deadline = time.monotonic() + 60
    while not any(each.phase == 'move' for each in feedback) and time.monotonic() < deadline:
        client.wait_for_message('/clock')
    answer = finished(handle.cancel_goal_async())
    assert [bytes(each.goal_id.uuid) for each in answer.goals_canceling] == [
        bytes(handle.goal_id.uuid)
    ]
    ended = finished(handle.get_result_async())
    assert (ended.status, ended.result.outcome) == (
        GoalStatus.STATUS_CANCELED, MotionOutcome.HELD
    )  # fmt: skip
    assert 'cancelled' in ended.result.message
    assert client.act('human', 'chicken', 'place_left').outcome == MotionOutcome.COMPLETED


@pytest.mark.parametrize(('x', 'y'), [(float('nan'), -0.2), (0.44, float('inf'))])
def test_an_object_off_the_table_is_refused(client: Client, x: float, y: float) -> None:
    said, deadline = '', time.monotonic() + 20
    while 'over the table' not in said and time.monotonic() < deadline:
        client.show_chicken(y=y, x=x)
        answer = client.act('arm', 'chicken', 'push_left')
        said = answer.message
    assert answer.outcome == MotionOutcome.OBJECT_NOT_SEEN
    assert said.startswith('Expected the chicken over the table')


def test_a_push_that_would_take_another_object_along_is_refused(client: Client) -> None:
    answer, deadline = ExecuteAction.Response(message=''), time.monotonic() + 20
    while 'No way to push' not in answer.message and time.monotonic() < deadline:
        client.show_chicken(y=-0.2, unknown=Point(x=0.44, y=-0.05))
        answer = client.act('arm', 'chicken', 'push_left')
    assert answer.outcome == ExecuteAction.Request.NOT_FREE == MotionOutcome.NOT_FREE
    assert answer.message.endswith('to LEFT is free: the unknown object 1 is in it.')
    assert stamp_ns(answer.started) == 0


def test_other_frames_are_not_acted_on(client: Client) -> None:
    client.show_chicken(y=-0.2, frame='map')
    assert client.act('arm', 'chicken', 'push_left').outcome == MotionOutcome.OBJECT_NOT_SEEN


def test_hold_in_the_middle_and_resume(client: Client) -> None:
    moving = client.start(
        ExecuteAction, 'human/execute_action', object='chicken', action='place_left'
    )
    client.wait_for(lambda: bool(client.kept['/clock']))
    began = client.now
    client.wait_for(lambda: client.now > began + 1_500_000_000)
    assert client.call(Trigger, 'cell/hold').success
    held = finished(moving, 5.0)
    assert held.outcome == MotionOutcome.HELD
    assert client.act('human', 'chicken', 'place_left').outcome == MotionOutcome.HELD
    client.wait_for(lambda: client.now > stamp_ns(held.finished) + 200_000_000)
    assert client.call(Trigger, 'cell/resume').success


@pytest.mark.parametrize(
    ('name', 'action', 'outcome'),
    [
        ('banana', 'place_left', MotionOutcome.UNKNOWN_OBJECT),
        ('pear', 'lift', MotionOutcome.UNKNOWN_ACTION),
        ('pear', '', MotionOutcome.UNKNOWN_ACTION),
    ],
)
@pytest.mark.parametrize('who', ['arm', 'human'])
def test_unknown_objects_and_actions_are_refused(
    client: Client, who: str, name: str, action: str, outcome: MotionOutcome
) -> None:
    answer = client.act(who, name, action)
    assert (answer.success, answer.outcome) == (False, outcome)
    assert answer.message.startswith('Expected')


def test_an_expired_request_is_not_started(client: Client) -> None:
    client.wait_for(lambda: client.now > 0)
    past = time_msg(client.now - 2_000_000_000)
    assert client.act('human', 'pear', 'place_left', expires=past).outcome == MotionOutcome.EXPIRED
    future = time_msg(client.now + 60_000_000_000)
    assert (
        client.act('human', 'pear', 'place_left', expires=future).outcome
        == MotionOutcome.COMPLETED
    )


def test_reset_refuses_with_a_sentence(client: Client) -> None:
    answer = client.call(ResetCell, 'cell/reset', objects=['pear'], states=['up'])
    assert not answer.success
    assert answer.outcome == ResetOutcome.INVALID_REQUEST
    assert answer.message == ("Expected a state of chung2015 (left, right, offtable), got 'up'.")


def test_parameters_out_of_range_are_refused(client: Client) -> None:
    from rcl_interfaces.srv import SetParameters

    for name, value in (('real_time_factor', -1.0), ('camera_rate', 20.0)):
        parameter = Parameter(name, value=value).to_parameter_msg()
        answer = client.call(SetParameters, 'arm_driver/set_parameters', parameters=[parameter])
        assert not answer.results[0].successful


@pytest.mark.parametrize(
    'argument', ['camera_rate:=500.0', 'initial_states:=[apple]', 'initial_states:=["apple:LEFT"]']
)
def test_a_bad_start_says_why(domain: int, argument: str) -> None:
    driver = start_driver(domain, '-p', argument)
    out, _ = driver.communicate(timeout=30)
    assert driver.returncode == os.EX_CONFIG
    assert 'arm_driver does not start: ' in out.splitlines()[-1]
    assert 'Traceback' not in out


@pytest.mark.parametrize(('number', 'moving'), [(signal.SIGINT, False), (signal.SIGTERM, True)])
def test_a_signal_ends_it_silently(number: int, moving: bool) -> None:
    with domain_id() as domain:
        driver, client = start_driver(domain), Client(domain)
        try:
            if moving:
                wanted = {'object': 'pear', 'action': 'place_left'}
                answer = client.start(ExecuteAction, 'human/execute_action', **wanted)
            client.wait_for(lambda: len(client.kept['/clock']) > 30)
            driver.send_signal(number)
            out, _ = driver.communicate(timeout=30)
            if moving:
                assert finished(answer, 30.0).outcome == MotionOutcome.HELD
        finally:
            driver.kill()
            client.close()
    assert driver.returncode == 0, out
    said = [line for line in out.splitlines() if 'pybullet build time' not in line]
    assert 'ready' in said[0]
    assert len(said) == 1 + moving, out

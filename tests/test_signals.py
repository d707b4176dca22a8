"""How processes end: SIGINT and SIGTERM while messages arrive, and jobs in the background."""

from __future__ import annotations

import math
import os
import signal
import subprocess
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped
from rclpy.qos import qos_profile_sensor_data
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CameraInfo, Image

from graph import LATCHED, Graph
from likeme_msgs.msg import FrameDone, Heard, ObjectState, TableState

SCRIPTS = Path(__file__).parents[1] / 'scripts'
#: s between two messages: enough for a node to be busy, and little for this process.
PAUSE = 0.001

Publish = Callable[[int], None]


class Target(NamedTuple):
    """A node: its module, who sends it the k-th messages, and what it publishes meanwhile."""

    module: str
    sender: Callable[[Graph], Publish]
    answers: tuple[type, str, Any]


def table_states(graph: Graph) -> Publish:
    """Table states on which an object changes its place with every one."""
    publisher = graph.node.create_publisher(TableState, 'table_state', 10)

    def publish(k: int) -> None:
        left = k % 2 == 0
        pear = ObjectState(name='pear', state=int(not left), visible=True, settled=True)
        pear.state_probability = [float(left), float(not left), 0.0]
        pear.centroid.x, pear.centroid.y = 0.4, 0.1 if left else -0.1
        msg = TableState(reference_frame='base_link', settled=True, objects=[pear])
        msg.header.stamp.sec, msg.header.stamp.nanosec = divmod(k * 10**7 + 10**9, 10**9)
        publisher.publish(msg)

    return publish


def frames(graph: Graph) -> Publish:
    """Colour, depth and camera info of an empty table of 64x48 pixels."""
    names = ('camera_info', 'image_rect_color')
    info_pub = graph.node.create_publisher(
        CameraInfo, f'camera/rgb/{names[0]}', qos_profile_sensor_data
    )
    colour_pub = graph.node.create_publisher(
        Image, f'camera/rgb/{names[1]}', qos_profile_sensor_data
    )
    depth_pub = graph.node.create_publisher(
        Image, 'camera/depth_registered/image_rect', qos_profile_sensor_data
    )
    info = CameraInfo(width=64, height=48, k=[52.0, 0.0, 31.5, 0.0, 52.0, 23.5, 0.0, 0.0, 1.0])
    colour = Image(width=64, height=48, encoding='rgb8', step=192)
    colour.data = np.full(64 * 48 * 3, 160, np.uint8).tobytes()
    depth = Image(width=64, height=48, encoding='16UC1', step=128)
    depth.data = np.full(64 * 48, 900, np.uint16).tobytes()

    def publish(k: int) -> None:
        stamp, frame = divmod(k * 3 * 10**7 + 10**9, 10**9), 'camera'
        for msg, publisher in ((info, info_pub), (colour, colour_pub), (depth, depth_pub)):
            msg.header.stamp.sec, msg.header.stamp.nanosec = stamp
            msg.header.frame_id = frame
            publisher.publish(msg)

    return publish


def head_poses(graph: Graph) -> Publish:
    """A mentor's head before it turns, and after."""
    start_pub = graph.node.create_publisher(PoseStamped, 'mentor/head_pose/start', 10)
    pose_pub = graph.node.create_publisher(PoseStamped, 'mentor/head_pose', 10)

    def publish(k: int) -> None:
        msg = PoseStamped()
        msg.header.frame_id = 'base_link'
        msg.header.stamp.sec, msg.header.stamp.nanosec = divmod(k * 10**7 + 10**9, 10**9)
        yaw = 0.75 * math.pi if k % 4 else math.pi
        msg.pose.position.x = 6.0
        msg.pose.orientation.z, msg.pose.orientation.w = math.sin(yaw / 2), math.cos(yaw / 2)
        (pose_pub if k % 4 else start_pub).publish(msg)

    return publish


TARGETS = {
    target.module.rpartition('.')[2]: target
    for target in (
        Target('likeme_inference.inference_node', table_states, (Heard, 'heard', 10)),
        Target('likeme_perception.perception_node', frames, (FrameDone, 'frame_done', 10)),
        Target('likeme_arm_sim.arm_driver_node', table_states, (Clock, '/clock', 10)),
        Target(
            'likeme_gaze.gaze_node',
            head_poses,
            (PoseWithCovarianceStamped, 'mentor/goal', LATCHED),
        ),
    )
}


def enough(answers: list[Any]) -> bool:
    """Whether a node is in the midst of answering."""
    return len(answers) > 20


@contextmanager
def flood(publish: Publish) -> Iterator[None]:
    """Publish a message every PAUSE from a thread of its own."""
    done = threading.Event()

    def run() -> None:
        k = 0
        while not done.wait(PAUSE):
            publish(k)
            k += 1

    thread = threading.Thread(target=run)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()


@pytest.mark.graph
@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize('target', TARGETS.values(), ids=TARGETS)
def test_a_node_ends_cleanly_while_messages_arrive(
    tmp_path: Path, target: Target, number: signal.Signals
) -> None:
    with Graph(tmp_path) as graph:
        answers = graph.collect(*target.answers)
        node = graph.start(target.module)
        with flood(target.sender(graph)):
            graph.until(partial(enough, answers), 60, 'answers to the messages')
            node.signal(number)
            assert node.wait(20) == 0, node.said
        assert 'Traceback' not in node.said, node.said


def handling(number: str, ignored: str) -> str:
    """How a command handles a signal that a script starts in the background by run.sh."""
    program = f'import signal; print(repr(signal.getsignal(signal.{number})))'
    script = f'trap "" {ignored}; "$@" & wait $!'
    command = ['sh', '-c', script, 'sh', SCRIPTS / 'run.sh', 'python', '-c', program]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
    return done.stdout.strip()


def test_a_background_job_of_a_script_can_be_interrupted() -> None:
    assert 'default_int_handler' in handling('SIGINT', ignored='INT')


def test_what_nohup_ignores_stays_ignored() -> None:
    assert handling('SIGHUP', ignored='HUP') == '<Handlers.SIG_IGN: 1>'


@pytest.mark.graph
@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_a_cell_in_the_background_of_a_script_ends_by_a_signal(
    tmp_path: Path, number: signal.Signals
) -> None:
    with Graph(tmp_path) as graph:
        start = (
            f'"{SCRIPTS}/start_cell.sh" --only inference & echo "pid $!"; wait $!; echo "code $?"'
        )
        script = graph.run('script', 'sh', '-c', start)
        graph.until(lambda: 'pid ' in script.said and 'inference |' in script.said, 60, 'the node')
        pid = int(script.said.partition('pid ')[2].split()[0])
        os.kill(pid, number)
        assert script.wait(30) == 0
        assert 'code 0' in script.said
        assert 'Traceback' not in script.said

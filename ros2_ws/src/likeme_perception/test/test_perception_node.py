"""The node on its own ROS domain: table state, bad input, parameters, signals."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from array import array
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import cv2
import numpy as np
import pytest

rclpy = pytest.importorskip('rclpy')

from diagnostic_msgs.msg import DiagnosticArray  # noqa: E402
from domain_coordinator import domain_id  # noqa: E402
from lifecycle_msgs.msg import Transition  # noqa: E402
from lifecycle_msgs.srv import ChangeState  # noqa: E402
from rclpy.executors import SingleThreadedExecutor  # noqa: E402
from rclpy.parameter import Parameter  # noqa: E402
from rclpy.qos import ReliabilityPolicy  # noqa: E402
from rosgraph_msgs.msg import Clock  # noqa: E402
from sensor_msgs.msg import CameraInfo, CompressedImage, Image  # noqa: E402
from std_srvs.srv import Trigger  # noqa: E402
from tf2_msgs.msg import TFMessage  # noqa: E402
from visualization_msgs.msg import MarkerArray  # noqa: E402

from in_process import refusal  # noqa: E402
from likeme_core.heartbeats import NodeState  # noqa: E402
from likeme_core.paper_world import WORLD  # noqa: E402
from likeme_core.ros.heartbeat import HeartbeatSubscriber  # noqa: E402
from likeme_core.ros.qos import LATCHED  # noqa: E402
from likeme_core.ros.time import stamp_ns, time_msg  # noqa: E402
from likeme_core.world.edit import with_object  # noqa: E402
from likeme_core.world.file import world_path  # noqa: E402
from likeme_core.world.folder import WORLDS_FOLDER  # noqa: E402
from likeme_msgs.msg import FrameDone, ObjectState, TableState  # noqa: E402
from likeme_perception.perception_node import PerceptionNode, main  # noqa: E402
from likeme_perception.rgbd import RgbdFrame  # noqa: E402
from transforms import matrix  # noqa: E402

COLOUR, DEPTH = 'camera/rgb/image_rect_color', 'camera/depth_registered/image_rect'

TOPICS = {
    'raw': ((COLOUR, Image), (DEPTH, Image)),
    'compressed': (
        (f'{COLOUR}/compressed', CompressedImage), (f'{DEPTH}/compressedDepth', CompressedImage),
    ),
}  # fmt: skip


def info_of(frame: RgbdFrame) -> CameraInfo:
    """The renderer's intrinsics."""
    height, width = frame.depth.shape
    info = CameraInfo(height=height, width=width)
    info.k = [262.5, 0.0, 159.5, 0.0, 262.5, 119.5, 0.0, 0.0, 1.0]
    return info


def image_of(frame: RgbdFrame, pixels: np.ndarray, encoding: str) -> Image:
    """Pixels as a message with the frame's stamp."""
    image = Image(height=pixels.shape[0], width=pixels.shape[1], encoding=encoding)
    image.step = pixels[0].nbytes
    image.data = array('B', np.ascontiguousarray(pixels).tobytes())
    image.header.stamp = time_msg(frame.stamp)
    image.header.frame_id = 'camera_rgb_optical_frame'
    return image


def compressed_of(frame: RgbdFrame, pixels: np.ndarray, before: bytes = b'') -> CompressedImage:
    """Pixels as PNG, after some bytes, with the frame's stamp."""
    png = cv2.imencode('.png', pixels)[1].tobytes()
    image = CompressedImage(format='16UC1; compressedDepth png', data=before + png)
    image.header.stamp = time_msg(frame.stamp)
    return image


class Rig:
    """The node, and a second node that publishes images and subscribes to the results."""

    def __init__(self, transport: str = 'raw', world: str = 'chung2015') -> None:
        values = {
            'background_frames': 5, 'min_object_area': 0.0002, 'image_transport': transport,
            'world': world,
        }  # fmt: skip
        self.node = PerceptionNode([Parameter(name, value=v) for name, v in values.items()])
        self.probe = rclpy.create_node('probe')
        self._send = {
            topic: self.probe.create_publisher(kind, topic, 5)
            for topic, kind in (*TOPICS[transport], ('camera/rgb/camera_info', CameraInfo))
        }
        self.states: list[TableState] = []
        self.diagnostics: list[DiagnosticArray] = []
        self.markers: list[MarkerArray] = []
        self.probe.create_subscription(TableState, 'table_state', self.states.append, 10)
        self.probe.create_subscription(
            DiagnosticArray, '/diagnostics', self.diagnostics.append, 10
        )
        self.probe.create_subscription(MarkerArray, 'table_markers', self.markers.append, 10)
        self.executor = SingleThreadedExecutor()
        self.executor.add_node(self.node)
        self.executor.add_node(self.probe)
        self.until(
            lambda: all(p.get_subscription_count() for p in self._send.values()), 'discovery'
        )

    def until(self, met: Callable[[], bool], what: str, seconds: float = 60.0) -> None:
        """Spin until a condition holds."""
        end = time.monotonic() + seconds
        while not met():
            assert time.monotonic() < end, f'{what} did not come within {seconds} s'
            self.executor.spin_once(timeout_sec=0.05)

    def info(self, frame: RgbdFrame) -> None:
        """Send camera_info and wait until the node has it."""
        self._send['camera/rgb/camera_info'].publish(info_of(frame))
        self.until(lambda: self.node._reader.intrinsics is not None, 'camera_info')

    def send(
        self, frame: RgbdFrame, encoding: str = 'rgb8', depth: np.ndarray | None = None
    ) -> None:
        """Send one frame and wait until the node has counted it."""
        mm = np.nan_to_num(frame.depth * 1000).astype(np.uint16) if depth is None else depth
        before = self.counted
        for topic, pixels, kind in ((COLOUR, frame.rgb, encoding), (DEPTH, mm, '16UC1')):
            self._send[topic].publish(image_of(frame, pixels, kind))
        self.until(lambda: self.counted > before, 'the count of the frame')

    @property
    def counted(self) -> int:
        return self.node.counts.received

    def dropped(self) -> dict[str, int]:
        return dict(self.node.counts.drops)


@pytest.fixture
def rig(request: pytest.FixtureRequest) -> Iterator[Rig]:
    with running(getattr(request, 'param', 'raw')) as made:
        yield made


@contextmanager
def running(transport: str = 'raw', world: str = 'chung2015') -> Iterator[Rig]:
    with domain_id() as domain:
        rclpy.init(domain_id=domain)
        made = Rig(transport, world)
        yield made
        made.executor.shutdown()
        made.node.destroy_node()
        made.probe.destroy_node()
        rclpy.try_shutdown()


def test_table_state_has_the_stamp_of_the_depth_image_and_the_frame_of_its_numbers(
    rig: Rig, renderer
) -> None:
    rig.info(renderer.frame())
    frames = [renderer.frame() for _ in range(8)]
    for frame in frames:
        rig.send(frame)
    rig.until(lambda: len(rig.states) >= 2, 'a table state')
    state = rig.states[-1]
    assert state.header.frame_id == state.reference_frame == 'base_link'
    assert state.camera_frame == 'camera_rgb_optical_frame'
    assert stamp_ns(state.header.stamp) in {frame.stamp for frame in frames}
    assert [o.name for o in state.objects] == ['pear', 'lemon', 'chicken']
    assert {o.state for o in state.objects} == {ObjectState.UNKNOWN} or {
        o.state for o in state.objects
    } == {ObjectState.OFFTABLE}
    assert len(rig.states) <= 4, 'no table state before the background is known'
    rig.until(lambda: bool(rig.markers), 'markers')
    rig.until(lambda: any(_level(d) == 0 for d in rig.diagnostics), 'diagnostics that are OK')


@pytest.mark.parametrize('rig', ['compressed'], indirect=True)
def test_compressed_images_are_read(rig: Rig, renderer) -> None:
    frame = renderer.frame()
    rig.info(frame)
    colour, depth = (topic for topic, _ in TOPICS['compressed'])
    mm = np.nan_to_num(frame.depth * 1000).astype(np.uint16)
    rig._send[colour].publish(compressed_of(frame, frame.rgb[:, :, ::-1]))
    rig._send[depth].publish(compressed_of(frame, mm, bytes(12)))
    rig.until(lambda: rig.node.counts.frames_read == 1, 'the frame')
    later = renderer.frame()
    rig._send[colour].publish(compressed_of(later, frame.rgb))
    rig._send[depth].publish(compressed_of(later, mm, b'no header'))
    rig.until(lambda: rig.dropped() == {'encoding': 1}, 'the refusal of what is no PNG')


def test_tf_static_has_table_regions_and_the_camera_as_perception_uses_it(
    rig: Rig, renderer
) -> None:
    heard: list[TFMessage] = []
    rig.probe.create_subscription(TFMessage, 'tf_static', heard.append, LATCHED)
    rig.info(renderer.frame())
    rig.until(lambda: bool(heard), 'frames before the first image')
    assert {t.child_frame_id for t in heard[-1].transforms} == {
        'table', 'region_LEFT', 'region_RIGHT'
    }  # fmt: skip
    for _ in range(7):
        rig.send(renderer.frame())
    background = rig.node._reader.perception.background
    rig.until(lambda: len(heard) >= 2, 'the camera as configured')
    # Configured with the first frame, levelled when the background was known.
    rig.until(lambda: len(heard) == 3, 'the camera as levelled')
    assert {t.header.frame_id for t in heard[-1].transforms} == {'base_link'}
    camera = heard[-1].transforms[-1]
    assert camera.child_frame_id == 'camera_rgb_optical_frame'
    pose = matrix(camera)
    np.testing.assert_allclose(pose, background.view.pose, atol=1e-9)
    np.testing.assert_allclose(pose, WORLD.camera.pose(), atol=0.01)
    left = heard[-1].transforms[1].transform.translation
    assert (left.y > 0, left.z) == (True, 0.0)


def test_latency_is_of_the_simulated_clock_once_it_is_heard(rig: Rig, renderer) -> None:
    clock = rig.probe.create_publisher(Clock, '/clock', 1)
    rig.node.set_parameters([Parameter('use_sim_time', value=True)])
    rig.info(renderer.frame())
    rig.send(renderer.frame())
    assert 'latency p50 (ms)' not in rig.node.counts.described()
    frame = renderer.frame()
    now = frame.stamp + 20_000_000
    rig.until(lambda: clock.get_subscription_count() > 0, 'the subscription of /clock')
    clock.publish(Clock(clock=time_msg(now)))
    rig.until(lambda: rig.node.get_clock().now().nanoseconds == now, 'the time')
    rig.send(frame)
    assert rig.node.counts.described()['latency p50 (ms)'] == '20.0'
    count = len(rig.diagnostics)
    # The clock stands still, diagnostics go on.
    rig.until(lambda: len(rig.diagnostics) >= count + 2, 'diagnostics')
    assert stamp_ns(rig.diagnostics[-1].header.stamp) == now


def test_qos_of_camera_topics_and_table_state_is_set_by_parameters() -> None:
    camera, table = '/camera/rgb/image_rect_color', '/table_state'
    with domain_id() as domain:
        rclpy.init(domain_id=domain)
        changes = {f'{camera}.subscription': 'reliable', f'{table}.publisher': 'best_effort'}
        node = PerceptionNode(
            [Parameter(f'qos_overrides.{k}.reliability', value=v) for k, v in changes.items()]
        )
        (image,) = node.get_subscriptions_info_by_topic(camera)
        (depth,) = node.get_subscriptions_info_by_topic('/camera/depth_registered/image_rect')
        (state,) = node.get_publishers_info_by_topic(table)
        node.destroy_node()
        rclpy.try_shutdown()
    assert image.qos_profile.reliability is ReliabilityPolicy.RELIABLE
    assert depth.qos_profile.reliability is ReliabilityPolicy.BEST_EFFORT
    assert state.qos_profile.reliability is ReliabilityPolicy.BEST_EFFORT


def _level(message: DiagnosticArray) -> int:
    return int.from_bytes(message.status[0].level, 'little')


def test_bad_input_is_dropped_and_counted(rig: Rig, renderer) -> None:
    rig.send(renderer.frame())
    assert rig.dropped() == {'no camera_info': 1}
    rig.info(renderer.frame())
    rig.send(renderer.frame(), encoding='mono8')
    frame = renderer.frame()
    rig.send(frame, depth=np.ones((8, 8), np.uint16))
    rig.send(renderer.frame(), depth=np.zeros(frame.depth.shape, np.uint16))
    rig.send(frame)
    assert rig.dropped() == {
        'no camera_info': 1, 'encoding': 1, 'size': 1, 'no depth': 1, 'older than the last': 1,
    }  # fmt: skip
    rig.send(renderer.frame())
    rig.until(lambda: any('dropped: size' in _keys(d) for d in rig.diagnostics), 'the count')


def _keys(message: DiagnosticArray) -> set[str]:
    return {value.key for value in message.status[0].values}


def test_stamps_that_go_back_restart_tracking(rig: Rig, renderer) -> None:
    rig.info(renderer.frame())
    renderer.stamp = 60_000_000_000
    for _ in range(7):
        rig.send(renderer.frame())
    renderer.stamp = 0
    for _ in range(4):
        rig.send(renderer.frame())
    assert rig.dropped() == {'older than the last': 1}
    rig.until(lambda: bool(rig.states) and rig.states[-1].header.stamp.sec < 50, 'a state again')


def test_reset_reads_looks_anew_but_not_another_world(tmp_path: Path) -> None:
    path = tmp_path / 'mine.yaml'
    text = world_path('chung2015').read_text(encoding='utf-8')
    text = text.replace('meshes/', f'{WORLDS_FOLDER}/meshes/')
    path.write_text(text, encoding='utf-8')
    entry = {**WORLD.object('pear').looks, 'length': 0.1234}
    with running(world=str(path)) as rig:
        client = rig.probe.create_client(Trigger, 'perception/reset')
        rig.until(client.service_is_ready, 'the service')

        def answer(changed: str) -> str:
            path.write_text(changed, encoding='utf-8')
            future = client.call_async(Trigger.Request())
            rig.until(future.done, 'an answer')
            return str(future.result().message)

        longer = with_object(text, {'name': 'pear', 'looks': entry})
        assert answer(longer) == 'Perception waits for camera_info and frames.'
        known = rig.node._reader.settings.catalogue.objects
        assert known[0].length == 0.1234
        more = with_object(text, {'name': 'mug', 'looks': entry})
        assert 'as the file says now, start the cell anew.' in answer(more)
        assert 'The world file is as it was before: ' in answer('world: 2')
        assert rig.node._reader.settings.catalogue.objects == known


def test_reset_forgets_camera_background_and_objects(rig: Rig, renderer) -> None:
    client = rig.probe.create_client(Trigger, 'perception/reset')
    rig.until(client.service_is_ready, 'the service')
    rig.info(renderer.frame())
    for _ in range(7):
        rig.send(renderer.frame())
    rig.until(lambda: bool(rig.states), 'a table state')
    future = client.call_async(Trigger.Request())
    rig.until(future.done, 'the answer')
    assert future.result().success
    # Stamps may start anywhere, and camera_info of the old camera does not count.
    renderer.stamp = 0
    rig.send(renderer.frame())
    assert rig.dropped() == {'no camera_info': 1}
    rig.info(renderer.frame())
    states = len(rig.states)
    for _ in range(7):
        rig.send(renderer.frame())
    rig.until(lambda: len(rig.states) > states, 'a table state of the new background')
    assert 0 < len(rig.states) - states <= 3, 'the background must be learned anew'


def test_heartbeats_and_diagnostics_tell_the_health(rig: Rig, renderer) -> None:
    nodes = HeartbeatSubscriber(rig.probe).monitor.nodes

    def heard(state: NodeState) -> Callable[[], bool]:
        return lambda: '/perception_node' in nodes and nodes['/perception_node'].state is state

    rig.until(heard(NodeState.STARTING), 'STARTING')
    assert nodes['/perception_node'].message == 'no camera_info has come yet'
    rig.info(renderer.frame())
    for _ in range(7):
        rig.send(renderer.frame())
    rig.until(heard(NodeState.READY), 'READY')
    rig.until(heard(NodeState.DEGRADED), 'DEGRADED, as no more frames come')
    rig.diagnostics.clear()
    rig.until(lambda: bool(rig.diagnostics), 'diagnostics')
    values = {value.key: value.value for value in rig.diagnostics[-1].status[0].values}
    assert values['health'].startswith('degraded: no frame has come for ')
    assert values['version'] == nodes['/perception_node'].version


def test_an_inactive_node_publishes_nothing_of_its_frames(rig: Rig, renderer) -> None:
    done: list[FrameDone] = []
    rig.probe.create_subscription(FrameDone, 'frame_done', done.append, 10)
    change = rig.probe.create_client(ChangeState, 'perception_node/change_state')
    rig.until(change.service_is_ready, 'the service')

    def set_state(transition: int) -> None:
        request = ChangeState.Request(transition=Transition(id=transition))
        future = change.call_async(request)
        rig.until(future.done, 'an answer')
        assert future.result().success

    def show() -> None:
        rig._send['camera/rgb/camera_info'].publish(info_of(renderer.frame()))
        for _ in range(7):
            frame = renderer.frame()
            for topic, pixels, kind in (
                (COLOUR, frame.rgb, 'rgb8'),
                (DEPTH, np.nan_to_num(frame.depth * 1000).astype(np.uint16), '16UC1'),
            ):
                rig._send[topic].publish(image_of(frame, pixels, kind))
                rig.executor.spin_once(timeout_sec=0.05)

    set_state(Transition.TRANSITION_DEACTIVATE)
    assert rig.node._state()[1] == 'the node is not active'
    show()
    set_state(Transition.TRANSITION_CLEANUP)
    set_state(Transition.TRANSITION_CONFIGURE)
    assert (rig.states, done, rig.counted) == ([], [], 0)
    set_state(Transition.TRANSITION_ACTIVATE)
    rig.info(renderer.frame())
    for _ in range(7):
        rig.send(renderer.frame())
    rig.until(lambda: bool(rig.states), 'a table state')


def test_camera_info_is_acknowledged_with_the_reason_when_it_is_unusable(
    rig: Rig, renderer
) -> None:
    done: list[FrameDone] = []
    rig.probe.create_subscription(FrameDone, 'frame_done', done.append, 10)
    rig.until(lambda: rig.node._done_pub.get_subscription_count() > 0, 'a subscription')
    bad = info_of(renderer.frame())
    bad.k = [0.0] * 9
    rig._send['camera/rgb/camera_info'].publish(bad)
    rig.until(lambda: bool(done), 'an acknowledgement')
    rig.info(renderer.frame())
    rig.until(lambda: len(done) == 2, 'an acknowledgement')
    assert [message.kind for message in done] == [FrameDone.CAMERA_INFO] * 2
    assert 'focal lengths above 0, got 0' in done[0].reason
    assert done[1].reason == ''


def test_parameters_out_of_range_are_refused(rig: Rig) -> None:
    for name, value, said in (
        ('min_height', 5.0, ''),
        ('table', [0.6, 0.3, -0.3, 0.3], 'x_min < x_max'),
        ('table', [0.6, 0.3], 'table as 4 numbers'),
        ('camera_quaternion', [0.0, 0.0, 0.0, 2.0], 'quaternion of length 1'),
        ('human_sides', ['north'], 'human_sides among'),
        ('world', 'three_bins', 'read-only'),
    ):
        result = rig.node.set_parameters([Parameter(name, value=value)])[0]
        assert not result.successful
        assert said in result.reason
    assert rig.node.set_parameters([Parameter('place_rise', value=0.05)])[0].successful
    assert rig.node._reader.settings.config.place_rise == 0.05


def start_node(domain: int, *arguments: str) -> subprocess.Popen[str]:
    """The node as a process of its own."""
    command = [sys.executable, '-m', 'likeme_perception.perception_node', '--ros-args', *arguments]
    env = os.environ | {'ROS_DOMAIN_ID': str(domain)}
    return subprocess.Popen(
        command, env=env, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )


def test_a_process_with_bad_parameters_says_one_sentence() -> None:
    with domain_id() as domain:
        node = start_node(domain, '-p', 'world:=/nowhere.yaml')
        out, _ = node.communicate(timeout=30)
    assert node.returncode == os.EX_CONFIG
    assert 'perception_node does not start: ' in out.splitlines()[-1]
    assert 'Traceback' not in out


@pytest.mark.parametrize(
    'parameters', [{'world': 'moon'}, {'min_height': 7.0}, {'image_transport': 'h264'}]
)
def test_bad_parameters_at_the_start_are_one_sentence(parameters: dict[str, object]) -> None:
    assert refusal(main, 'perception_node', **parameters)


class Camera:
    """Publishes images to a node process and collects its messages."""

    def __init__(self, domain: int) -> None:
        self.context = rclpy.Context()
        self.context.init(domain_id=domain)
        self.node = rclpy.create_node('camera', context=self.context)
        self._colour = self.node.create_publisher(Image, COLOUR, 5)
        self._depth = self.node.create_publisher(Image, DEPTH, 5)
        self._info = self.node.create_publisher(CameraInfo, 'camera/rgb/camera_info', 5)
        self.received: list[object] = []
        for kind, topic in ((TableState, 'table_state'), (DiagnosticArray, '/diagnostics')):
            self.node.create_subscription(kind, topic, self.received.append, 10)
        self.executor = SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.node)

    def states(self) -> int:
        """Number of table states received."""
        return sum(isinstance(message, TableState) for message in self.received)

    def show(self, frame: RgbdFrame) -> None:
        """Send one frame and spin once."""
        self._info.publish(info_of(frame))
        self._colour.publish(image_of(frame, frame.rgb, 'rgb8'))
        mm = np.nan_to_num(frame.depth * 1000).astype(np.uint16)
        self._depth.publish(image_of(frame, mm, '16UC1'))
        self.executor.spin_once(timeout_sec=0.05)

    def close(self) -> None:
        self.executor.shutdown()
        self.node.destroy_node()
        self.context.try_shutdown()


@pytest.mark.parametrize(('number', 'at_work'), [(signal.SIGINT, False), (signal.SIGTERM, True)])
def test_a_signal_ends_the_node_without_output(renderer, number: int, at_work: bool) -> None:
    with domain_id() as domain:
        node, camera = start_node(domain, '-p', 'background_frames:=2'), Camera(domain)
        end = time.monotonic() + 90
        try:
            while time.monotonic() < end and not (camera.states() if at_work else camera.received):
                camera.show(renderer.frame()) if at_work else camera.executor.spin_once(0.1)
            assert camera.received
            node.send_signal(number)
            while at_work and node.poll() is None and time.monotonic() < end:
                camera.show(renderer.frame())
            out, _ = node.communicate(timeout=30)
        finally:
            node.kill()
            camera.close()
    assert node.returncode == 0, out
    # Images may be discovered before camera_info: that warning is not part of the shutdown.
    usual = ('Background learned', 'no camera_info has come yet')
    assert [line for line in out.splitlines() if not any(word in line for word in usual)] == []

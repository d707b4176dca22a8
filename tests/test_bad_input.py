"""Perception over real topics and bad frames: dropped, counted, said once in a while, named."""

from __future__ import annotations

import re
import time
from array import array
from collections.abc import Callable, Iterator

import numpy as np
import pytest
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter
from sensor_msgs.msg import CameraInfo, Image

from graph import Graph, NodeProcess
from likeme_arm_sim.cell import Cell
from likeme_arm_sim.messages import camera_info_message, image_message
from likeme_core.paper_world import WORLD
from likeme_core.ros.time import stamp_ns, time_msg
from likeme_msgs.msg import FrameDone, TableState

pytestmark = pytest.mark.graph
FRAME = 33_333_333
SECOND = 1_000_000_000
LOG_PERIOD = 5.0

Pair = tuple[Image, Image]


class Watched:
    """A perception process, and a camera that this test plays with one picture of the cell."""

    def __init__(self, graph: Graph) -> None:
        self.graph, self.began = graph, time.monotonic()
        self.node = graph.start('likeme_perception.perception_node', background_frames=5)
        cell = Cell(WORLD, seed=1)
        cell.step(1.0)
        self._images, self._info = cell.frame(), camera_info_message(cell.world.camera)
        self.states = graph.collect(TableState, 'table_state')
        self._done = graph.collect(FrameDone, 'frame_done', 100)
        self._diagnostics = graph.collect(DiagnosticArray, '/diagnostics')
        self._colour = graph.publisher(Image, 'camera/rgb/image_rect_color', 5)
        self._depth = graph.publisher(Image, 'camera/depth_registered/image_rect', 5)
        self._infos = graph.publisher(CameraInfo, 'camera/rgb/camera_info', 5)
        self.stamp = 1_000 * SECOND

    def pair(self) -> Pair:
        """Make the next frame, a good one."""
        self.stamp += FRAME
        colour = image_message(self._images.rgb, 'rgb8')
        depth = image_message(self._images.depth_mm, '16UC1')
        for image in (colour, depth):
            image.header.stamp = time_msg(self.stamp)
            image.header.frame_id = 'camera_rgb_optical_frame'
        return colour, depth

    def send(self, colour: Image | None, depth: Image | None) -> None:
        """Publish what there is of a frame."""
        if colour is not None:
            self._colour.publish(colour)
        if depth is not None:
            self._depth.publish(depth)

    def send_info(self, info: CameraInfo | None = None) -> None:
        """Publish camera_info, the true one if no other is given."""
        self._infos.publish(info or self._info)

    @property
    def status(self) -> DiagnosticStatus:
        """What perception last said of itself."""
        self.graph.until(lambda: self._diagnostics, 10, 'diagnostics')
        return self._diagnostics[-1].status[0]

    def count(self, what: str) -> int:
        """Give a count of the diagnostics; 0 when it is not there."""
        return next((int(v.value) for v in self.status.values if v.key == what), 0)

    def until_counted(self, what: str, send: Callable[[], None]) -> None:
        """Send a bad thing, again if it got lost, until the diagnostics count it."""
        before = self.count(what)

        def counted() -> bool:
            send()
            return self.count(what) > before

        self.graph.until(counted, 10, f'{what!r} in the diagnostics')

    def until_refused(self, spoil: Callable[[Pair], Pair]) -> None:
        """Send a bad frame, again if it got lost, until it was refused with a sentence."""
        first = self.stamp

        def refused() -> bool:
            self.send(*spoil(self.pair()))
            return any(
                done.kind == FrameDone.REFUSED
                and done.reason
                and stamp_ns(done.header.stamp) > first
                for done in self._done
            )

        self.graph.until(refused, 10, f'{spoil.__name__} to be refused')

    def see(self, seconds: float = 10.0) -> None:
        """Send good frames until a table state of one of them has come."""
        first = self.stamp

        def seen() -> bool:
            self.send(*self.pair())
            last = stamp_ns(self.states[-1].header.stamp) if self.states else 0
            return first < last <= self.stamp

        self.graph.until(seen, seconds, 'a table state of a good frame')
        assert {o.name: o.state for o in self.states[-1].objects} == {
            'pear': 1, 'lemon': 0, 'chicken': 1,
        }  # fmt: skip


def blame_lines(node: NodeProcess) -> int:
    """How often the node said that it dropped frames."""
    return len(re.findall(r'\[WARN\] .*Frame dropped', node.said))


@pytest.fixture(scope='module')
def watched(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Watched]:
    with Graph(tmp_path_factory.mktemp('bad_input')) as graph:
        yield Watched(graph)


def test_frames_before_any_camera_info(watched: Watched) -> None:
    watched.until_counted('dropped: no camera_info', lambda: watched.send(*watched.pair()))
    assert watched.status.level == DiagnosticStatus.WARN
    assert 'Frame dropped (no camera_info)' in watched.node.said
    assert not watched.states


def test_camera_info_without_numbers(watched: Watched) -> None:
    watched.until_counted(
        'dropped: bad camera_info', lambda: watched.send_info(CameraInfo(height=480, width=640))
    )
    watched.send_info()
    watched.see()
    assert watched.node.alive


def encoding_of_colour(pair: Pair) -> Pair:
    pair[0].encoding = 'yuv422'
    return pair


def encoding_of_depth(pair: Pair) -> Pair:
    pair[1].encoding = 'mono8'
    return pair


def depth_of_another_size(pair: Pair) -> Pair:
    small = image_message(np.full((240, 320), 800, np.uint16), '16UC1')
    small.header = pair[1].header
    return pair[0], small


def both_of_another_size(pair: Pair) -> Pair:
    small = image_message(np.zeros((240, 320, 3), np.uint8), 'rgb8')
    small.header = pair[0].header
    return small, depth_of_another_size(pair)[1]


def torn_depth(pair: Pair) -> Pair:
    pair[1].data = pair[1].data[:-1000]
    return pair


def torn_colour(pair: Pair) -> Pair:
    pair[0].data = array('B')
    return pair


def a_step_too_small(pair: Pair) -> Pair:
    pair[1].step = 7
    return pair


def all_nan_depth(pair: Pair) -> Pair:
    nan = image_message(np.full((480, 640), np.nan, np.float32), '32FC1')
    nan.header = pair[1].header
    return pair[0], nan


def all_zero_depth(pair: Pair) -> Pair:
    zero = image_message(np.zeros((480, 640), np.uint16), '16UC1')
    zero.header = pair[1].header
    return pair[0], zero


def nothing_in_it(pair: Pair) -> Pair:
    return Image(header=pair[0].header), Image(header=pair[1].header)


@pytest.mark.parametrize(
    ('reason', 'spoilers'),
    [
        ('encoding', (encoding_of_colour, encoding_of_depth, nothing_in_it)),
        (
            'size',
            (
                depth_of_another_size, both_of_another_size, torn_depth, torn_colour,
                a_step_too_small,
            ),
        ),
        ('no depth', (all_nan_depth, all_zero_depth)),
    ],
    ids=lambda value: value if isinstance(value, str) else '',
)  # fmt: skip
def test_bad_frames_are_dropped_counted_and_named(
    watched: Watched, reason: str, spoilers: tuple[Callable[[Pair], Pair], ...]
) -> None:
    wanted = watched.count(f'dropped: {reason}') + len(spoilers)
    for spoil in spoilers:
        watched.until_refused(spoil)
        watched.see()
    watched.graph.until(
        lambda: watched.count(f'dropped: {reason}') >= wanted, 10, f'{wanted} in the diagnostics'
    )
    assert watched.status.level == DiagnosticStatus.WARN
    assert 'dropped' in watched.status.message
    assert watched.node.alive


def test_a_frame_older_than_the_last(watched: Watched) -> None:
    watched.see()
    late = watched.pair()
    for image in late:
        image.header.stamp = time_msg(watched.stamp - SECOND // 2)
    watched.until_counted('dropped: older than the last', lambda: watched.send(*late))
    watched.see()


def test_colour_without_depth_is_named(watched: Watched) -> None:
    watched.see()
    watched.until_counted(
        'dropped: colour without depth', lambda: watched.send(watched.pair()[0], None)
    )
    assert watched.status.level == DiagnosticStatus.WARN
    watched.until_counted(
        'dropped: depth without colour', lambda: watched.send(None, watched.pair()[1])
    )
    watched.see()


def test_a_stamp_from_the_future_is_got_over(watched: Watched) -> None:
    watched.see()
    ahead = watched.pair()
    for image in ahead:
        image.header.stamp = time_msg(watched.stamp + 3600 * SECOND)
    watched.send(*ahead)
    watched.see()


def test_a_camera_that_starts_anew_is_followed(watched: Watched) -> None:
    watched.see()
    watched.stamp = 7 * SECOND
    watched.states.clear()
    watched.send_info()
    watched.see()
    assert watched.states[-1].header.stamp.sec < 100


def test_stamps_at_the_ends_of_time(watched: Watched) -> None:
    watched.see()
    for stamp in (Time(sec=2**31 - 1, nanosec=2**32 - 1), Time(sec=-(2**31)), Time()):
        pair = watched.pair()
        for image in pair:
            image.header.stamp = stamp
        watched.send(*pair)
    watched.see()
    assert watched.node.alive


@pytest.mark.parametrize(
    ('name', 'value', 'why'),
    [
        ('min_height', 5.0, 'min_height'),
        ('still_time', float('nan'), ''),
        ('table', [0.6, 0.3, -0.3, 0.3], 'x_min < x_max'),
        ('camera_quaternion', [0.0, 0.0, 0.0, 2.0], 'quaternion'),
        ('background_frames', 0, 'background_frames'),
        ('place_rise', 'middle', 'DOUBLE'),
    ],
)
def test_parameters_out_of_range_are_refused_when_set(
    watched: Watched, name: str, value: object, why: str
) -> None:
    wanted = SetParameters.Request(parameters=[Parameter(name, value=value).to_parameter_msg()])
    answer = watched.graph.call(SetParameters, 'perception_node/set_parameters', wanted).results[0]
    assert not answer.successful
    assert why in answer.reason
    assert answer.reason.count('\n') == 0


def test_all_this_was_said_once_in_a_while(watched: Watched) -> None:
    # A line may be printed long after it was due: only their number is bounded.
    most = 1 + (time.monotonic() - watched.began) / LOG_PERIOD
    assert 0 < blame_lines(watched.node) <= most
    assert 'Traceback' not in watched.node.said

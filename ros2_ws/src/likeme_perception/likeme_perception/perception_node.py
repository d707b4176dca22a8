"""The ROS side of perception: images in, table state and demonstrations out."""

from __future__ import annotations

import time
from collections import Counter, deque
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.clock import Clock, ClockType
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import CameraInfo, Image
from visualization_msgs.msg import MarkerArray

from likeme_msgs.msg import Demonstration, TableState
from likeme_perception import messages
from likeme_perception.config import PerceptionConfig, config_from
from likeme_perception.identification import load_catalogue
from likeme_perception.observation import TableObservation
from likeme_perception.overlay import draw
from likeme_perception.pairing import StampOrder, StampPairing
from likeme_perception.pipeline import TabletopPerception
from likeme_perception.rgbd import Intrinsics, RgbdFrame

_LOG_PERIOD = 5.0
_MARKER_PERIOD = 0.2
_OVERLAY_PERIOD = 0.5

# Name, description, least and greatest value of the settings that are one number.
_NUMBERS: tuple[tuple[str, str, float, float], ...] = (
    ('blue_line_y', 'LEFT is y greater than this, m', -10.0, 10.0),
    ('fallen_depth', 'a centroid this far below the table top is OFFTABLE, m', 0.005, 1.0),
    ('min_height', 'least height of a thing over the table, m', 0.002, 0.1),
    ('height_sigmas', 'the same in standard deviations of the depth noise', 0.0, 20.0),
    ('cell_size', 'top-view cell that joins pixels to things, m', 0.001, 0.05),
    ('min_object_area', 'least seen area of a thing, m^2', 1e-5, 0.1),
    ('max_object_length', 'what is longer is a hand or an arm, m', 0.02, 2.0),
    ('cut_off_length', "what the image's edge cuts off and is longer is a limb, m", 0.02, 2.0),
    ('visible_fraction', "share of an object's area that must be seen to place it", 0.05, 1.0),
    ('min_identity', 'least probability to call pixels by a name', 0.0, 1.0),
    ('centroid_sigma', "standard deviation of a fully seen object's centroid, m", 1e-4, 0.1),
    ('rest_radius', 'an object that stays within this is at rest, m', 1e-3, 0.1),
    ('settle_time', 'for this long, s', 0.0, 10.0),
    ('absence_time', 'an object that is not seen for this long is OFFTABLE, s', 0.0, 10.0),
    ('intruder_min_area', 'least area of a hand or an arm in view, m^2', 1e-5, 0.1),
    ('hand_gone_time', 'a hand that is out of view for this long has left, s', 0.0, 10.0),
    ('still_time', 'a hand or arm that is still for this long is background, s', 1.0, 3600.0),
    ('settle_timeout', 'after a hand has left, wait this long for things to rest, s', 0.1, 60.0),
    ('place_rise', 'rise at which an object is as likely placed as pushed, m', 0.005, 0.5),
    ('place_rise_scale', 'width of that transition, m', 1e-3, 0.1),
)  # fmt: skip
_LISTS = {
    'camera_position': "position of the camera's optical frame, m; empty: estimated",
    'camera_quaternion': 'its orientation, x y z w',
    'table': 'table top: x_min x_max y_min y_max, m; empty: the plane as far as seen',
    'work_area': 'the part that is LEFT or RIGHT: x_min x_max y_min y_max, m; empty: all',
    'human_sides': "sides of the table a person's hand comes in over: near far left right",
    'robot_sides': "sides the robot's arm comes in over",
}


class PerceptionNode(Node):
    """Reads what is where on the table from a registered RGB-D camera.

    | publishes | type | |
    | --- | --- | --- |
    | table_state | likeme_msgs/TableState | per frame, once the background is known |
    | demonstration | likeme_msgs/Demonstration | one human act, when it is complete |
    | table_markers | visualization_msgs/MarkerArray | 5 Hz while anybody listens |
    | table_overlay | sensor_msgs/Image | the image with it drawn in, 2 Hz if heard |
    | /diagnostics | diagnostic_msgs/DiagnosticArray | 1 Hz: rate, latency, drops |

    | subscribes | type | |
    | --- | --- | --- |
    | camera/rgb/image_rect_color | sensor_msgs/Image | rgb8 or bgr8 |
    | camera/depth_registered/image_rect | sensor_msgs/Image | 16UC1 mm or 32FC1 m |
    | camera/rgb/camera_info | sensor_msgs/CameraInfo | the latest counts |

    Parameters: every number of PerceptionConfig by its name (rectangles as x_min, x_max, y_min,
    y_max), catalogue_file (empty: the cell's toys), pairing_tolerance (s). A change starts
    perception anew with the new numbers; one that makes no sense is refused.
    """

    def __init__(self, parameter_overrides: list[Parameter] | None = None) -> None:
        super().__init__('perception_node', parameter_overrides=parameter_overrides)
        self._declare_parameters()
        self.add_on_set_parameters_callback(self._check_parameters)
        self.add_post_set_parameters_callback(self._start_anew)

        self._intrinsics: Intrinsics | None = None
        self._perception: TabletopPerception | None = None
        self._drops: Counter[str] = Counter()
        self._reported: Counter[str] = Counter()
        self._last_warning = -_LOG_PERIOD
        self._latency: deque[float] = deque(maxlen=300)
        self._work: deque[float] = deque(maxlen=300)
        self._frames = 0
        self.frames_read = 0
        self._drawn = {'markers': 0, 'overlay': 0}
        self._start_anew([])

        self._table_pub = self.create_publisher(TableState, 'table_state', 1)
        self._demonstration_pub = self.create_publisher(Demonstration, 'demonstration', 10)
        self._marker_pub = self.create_publisher(MarkerArray, 'table_markers', 1)
        self._overlay_pub = self.create_publisher(Image, 'table_overlay', 1)
        self._diagnostics_pub = self.create_publisher(DiagnosticArray, '/diagnostics', 10)

        # Sensor data with a short queue: when work piles up, only the newest frames are wanted.
        qos = QoSProfile(depth=2, reliability=ReliabilityPolicy.BEST_EFFORT)
        colour, depth = 'camera/rgb/image_rect_color', 'camera/depth_registered/image_rect'
        self.create_subscription(Image, colour, lambda m: self._on_image(0, m), qos)
        self.create_subscription(Image, depth, lambda m: self._on_image(1, m), qos)
        self.create_subscription(CameraInfo, 'camera/rgb/camera_info', self._on_info, qos)
        # A steady clock: diagnostics go on while /clock stands still.
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._last_diagnostics = time.monotonic()
        self.create_timer(1.0, self._publish_diagnostics, clock=steady)

    def _declare_parameters(self) -> None:
        default = PerceptionConfig()
        for name, text, low, high in _NUMBERS:
            limits = [FloatingPointRange(from_value=low, to_value=high)]
            about = ParameterDescriptor(description=text, floating_point_range=limits)
            self.declare_parameter(name, float(getattr(default, name)), about)
        for name, text in _LISTS.items():
            # Dynamic typing: an empty list has no element type of its own.
            about = ParameterDescriptor(description=text, dynamic_typing=True)
            self.declare_parameter(name, _as_list(getattr(default, name)), about)
        frames = [IntegerRange(from_value=1, to_value=1000, step=1)]
        about = ParameterDescriptor(
            description='frames to learn the background from', integer_range=frames
        )
        self.declare_parameter('background_frames', default.background_frames, about)
        self.declare_parameter(
            'empty_at_start',
            default.empty_at_start,
            ParameterDescriptor(
                description='nothing stands on the table while the background is learned'
            ),
        )
        self.declare_parameter(
            'reference_frame',
            default.reference_frame,
            ParameterDescriptor(description='frame of all positions: x forward, y left, z up'),
        )
        self.declare_parameter(
            'catalogue_file',
            '',
            ParameterDescriptor(description="YAML of known objects; empty: the cell's toys"),
        )
        self.declare_parameter(
            'pairing_tolerance',
            0.016,
            ParameterDescriptor(
                description='greatest difference of the stamps of a colour and a depth image, s',
                floating_point_range=[FloatingPointRange(from_value=0.0, to_value=1.0)],
            ),
        )

    def _values(self, changes: list[Parameter]) -> dict[str, Any]:
        """All parameters after some changes, lists as PerceptionConfig wants them."""
        names = [n for n, *_ in _NUMBERS] + [*_LISTS]
        names += ['background_frames', 'empty_at_start', 'reference_frame', 'catalogue_file']
        values = {name: self.get_parameter(name).value for name in names}
        values |= {p.name: p.value for p in changes if p.name in values}
        for name in ('camera_position', 'table', 'work_area'):
            values[name] = tuple(values[name]) if values[name] else None
        return {k: tuple(v) if isinstance(v, list) else v for k, v in values.items()}

    def _check_parameters(self, changes: list[Parameter]) -> SetParametersResult:
        try:
            values = self._values(changes)
            load_catalogue(_path(values.pop('catalogue_file')))
            config_from(values).camera_pose()
        except (ValueError, TypeError, OSError) as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _start_anew(self, _: list[Parameter]) -> None:
        values = self._values([])
        self._catalogue = load_catalogue(_path(values.pop('catalogue_file')))
        self._config = config_from(values)
        self._pairing: StampPairing[Image] = StampPairing(
            self.get_parameter('pairing_tolerance').value,
            lambda m: messages.nanoseconds(m.header.stamp),
        )
        self._order = StampOrder()
        self._perception = None

    def _on_info(self, info: CameraInfo) -> None:
        try:
            intrinsics = messages.intrinsics_of(info)
        except ValueError as error:
            self._drop('bad camera_info', str(error))
            return
        if intrinsics != self._intrinsics:
            self._intrinsics, self._perception = intrinsics, None

    def _on_image(self, stream: int, image: Image) -> None:
        pair = self._pairing.add(stream, image)
        if pair is not None:
            self._on_pair(*pair)

    def _on_pair(self, colour: Image, depth: Image) -> None:
        begin = time.perf_counter()
        order = self._order.take(messages.nanoseconds(depth.header.stamp))
        if order == 'older':
            self._drop('older than the last', 'a frame is older than the one before it')
            return
        if order == 'restart' and self._perception is not None:
            self._perception.reset_tracking()
            self.get_logger().info('Stamps went back: a new start. Objects are tracked anew.')
        if self._intrinsics is None:
            self._drop('no camera_info', 'no camera_info has come yet')
            return
        try:
            frame = messages.frame_of(colour, depth)
            if not frame.has_depth:
                raise ValueError(f'Expected depth readings, got 0 of {frame.depth.size}.')
            table = self._process(frame, self._intrinsics)
        except ValueError as error:
            self._drop(_reason(str(error)), str(error))
            return
        if table.learned:
            self._publish(table, frame, depth)
        self._frames += 1
        self.frames_read += 1
        self._work.append(time.perf_counter() - begin)
        self._latency.append((self.get_clock().now().nanoseconds - frame.stamp) * 1e-9)

    def _process(self, frame: RgbdFrame, intrinsics: Intrinsics) -> TableObservation:
        if self._perception is None:
            self._perception = TabletopPerception(self._config, intrinsics, self._catalogue)
        learned_before = self._perception.background is not None
        table = self._perception.process(frame)
        if table.learned and not learned_before:
            names = ', '.join(o.name for o in table.objects)
            self.get_logger().info(f'Background learned. Watching the table for: {names}.')
        return table

    def _publish(self, table: TableObservation, frame: RgbdFrame, depth: Image) -> None:
        self._table_pub.publish(
            messages.table_state(table, depth.header, self._config.reference_frame)
        )
        for act in table.demonstrations:
            self._demonstration_pub.publish(messages.demonstration(act, depth.header))
            self.get_logger().info(
                f'Seen: {act.object} from {act.x_i.name} to {act.x_f.name} by '
                f'{act.manner.name.lower()} ({act.manner_probability:.2f}).'
            )
        self._publish_pictures(table, frame, depth)

    def _publish_pictures(self, table: TableObservation, frame: RgbdFrame, depth: Image) -> None:
        perception = self._perception
        if perception is None or perception.background is None or perception.regions is None:
            return
        if self._due('markers', _MARKER_PERIOD, frame.stamp, self._marker_pub):
            self._marker_pub.publish(
                messages.table_markers(table, self._config, perception.regions, depth.header.stamp)
            )
        if self._due('overlay', _OVERLAY_PERIOD, frame.stamp, self._overlay_pub):
            image = draw(frame.rgb, table, perception.background.view, perception.regions)
            self._overlay_pub.publish(messages.image_message(image, depth.header))

    def _due(self, what: str, period: float, stamp: int, publisher: Any) -> bool:
        if (
            publisher.get_subscription_count() == 0
            or abs(stamp - self._drawn[what]) < period * 1e9
        ):
            return False
        self._drawn[what] = stamp
        return True

    def _drop(self, reason: str, sentence: str) -> None:
        """Count a dropped frame, and say so at most once in a while."""
        self._drops[reason] += 1
        now = time.monotonic()
        if now - self._last_warning >= _LOG_PERIOD:
            self._last_warning = now
            count = sum(self._drops.values())
            self.get_logger().warning(
                f'Frame dropped ({reason}): {sentence} {count} dropped so far.'
            )

    def _publish_diagnostics(self) -> None:
        now = time.monotonic()
        rate = self._frames / max(now - self._last_diagnostics, 1e-6)
        self._frames, self._last_diagnostics = 0, now
        new_drops = sum(self._drops.values()) - sum(self._reported.values())
        self._reported = self._drops.copy()
        learned = self._perception is not None and self._perception.background is not None
        status = DiagnosticStatus(
            name='likeme_perception: camera to table state', hardware_id='camera'
        )
        status.level, status.message = _judgement(rate, new_drops, learned)
        values = {'frame rate (Hz)': f'{rate:.1f}', 'background learned': str(learned)}
        for name, times in (('latency', self._latency), ('processing time', self._work)):
            if times:
                p50, p99 = np.percentile(np.array(times) * 1e3, [50, 99])
                values |= {f'{name} p50 (ms)': f'{p50:.1f}', f'{name} p99 (ms)': f'{p99:.1f}'}
        values['unpaired images'] = str(self._pairing.unpaired)
        if self._perception is not None:
            values['background restarts'] = str(self._perception.restarts)
            values['still intruders made background'] = str(self._perception.absorbed)
            shared = self._perception.demonstrations.shared_acts
            values['acts with hand and arm at once'] = str(shared)
        values |= {f'dropped: {reason}': str(n) for reason, n in sorted(self._drops.items())}
        status.values = [KeyValue(key=k, value=v) for k, v in values.items()]
        message = DiagnosticArray(status=[status])
        message.header.stamp = self.get_clock().now().to_msg()
        self._diagnostics_pub.publish(message)


def _judgement(rate: float, new_drops: int, learned: bool) -> tuple[bytes, str]:
    """Level and sentence of the diagnostics."""
    if rate == 0 and new_drops == 0:
        return DiagnosticStatus.STALE, 'no frames'
    if new_drops:
        return DiagnosticStatus.WARN, f'{new_drops} frames dropped in the last second'
    if not learned:
        return DiagnosticStatus.WARN, 'learning the background'
    return DiagnosticStatus.OK, 'watching the table'


def _reason(sentence: str) -> str:
    """A short word for what was wrong with a frame."""
    for word, reason in (
        (' as 16UC1', 'encoding'), (' as rgb8', 'encoding'), ('depth readings', 'no depth'),
        ('table at z = 0', 'no table'), ('plane', 'no table'),
    ):  # fmt: skip
        if word in sentence:
            return reason
    return 'size'


def _as_list(value: Any) -> list[Any]:
    if value is None:
        return []
    if hasattr(value, 'x_min'):
        return [value.x_min, value.x_max, value.y_min, value.y_max]
    return list(value)


def _path(text: str) -> Path | None:
    return Path(text).expanduser() if text else None


def main(args: list[str] | None = None) -> None:
    """Entry point of `perception_node`."""
    cv2.setNumThreads(1)
    rclpy.init(args=args)
    node = PerceptionNode()
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == '__main__':
    main()

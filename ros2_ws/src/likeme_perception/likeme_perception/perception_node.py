"""The ROS side of perception: images in, table state and demonstrations out."""

from __future__ import annotations

import sys
import time

import cv2
from diagnostic_msgs.msg import DiagnosticArray
from rcl_interfaces.msg import SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter
from sensor_msgs.msg import CameraInfo, Image
from visualization_msgs.msg import MarkerArray

from likeme_core.ros import parameters
from likeme_core.ros.qos import CAMERA
from likeme_core.ros.spin import run_node
from likeme_core.ros.time import stamp_ns, steady_clock
from likeme_msgs.msg import Demonstration, FrameDone, TableState
from likeme_perception import messages
from likeme_perception.errors import FrameError, NoDepthError
from likeme_perception.frame_counts import FrameCounts, Throttle
from likeme_perception.node_settings import SETTINGS, read_settings
from likeme_perception.observation import TableObservation
from likeme_perception.overlay import draw
from likeme_perception.pairing import StampOrder, StampPairing
from likeme_perception.pipeline import TabletopPerception
from likeme_perception.rgbd import Intrinsics, RgbdFrame


class PerceptionNode(Node):
    """Reads what is where on the table from a registered RGB-D camera.

    | publishes | type | |
    | --- | --- | --- |
    | table_state | likeme_msgs/TableState | per frame, once the background is known |
    | demonstration | likeme_msgs/Demonstration | one human act, when it is complete |
    | frame_done | likeme_msgs/FrameDone | each frame and camera_info, when it is done with |
    | table_markers | visualization_msgs/MarkerArray | 5 Hz while anybody listens |
    | table_overlay | sensor_msgs/Image | the image with it drawn in, 2 Hz if heard |
    | /diagnostics | diagnostic_msgs/DiagnosticArray | 1 Hz: rate, latency, drops |

    | subscribes | type | |
    | --- | --- | --- |
    | camera/rgb/image_rect_color | sensor_msgs/Image | rgb8 or bgr8 |
    | camera/depth_registered/image_rect | sensor_msgs/Image | 16UC1 mm or 32FC1 m |
    | camera/rgb/camera_info | sensor_msgs/CameraInfo | the latest counts |

    Parameters: node_settings.SETTINGS, every number of PerceptionConfig by its name (rectangles as
    x_min, x_max, y_min, y_max), catalogue_file and pairing_tolerance. A change starts perception
    anew with the new numbers; one that makes no sense is refused.
    """

    def __init__(self, parameter_overrides: list[Parameter] | None = None) -> None:
        super().__init__('perception_node', parameter_overrides=parameter_overrides)
        parameters.declare(self, SETTINGS)
        self.add_on_set_parameters_callback(self._check_parameters)
        self.add_post_set_parameters_callback(self._start_anew)

        self._intrinsics: Intrinsics | None = None
        self.counts = FrameCounts(time.monotonic())
        self._marker_times, self._overlay_times = Throttle(0.2), Throttle(0.5)
        self._start_anew([])

        self._table_pub = self.create_publisher(TableState, 'table_state', 1)
        self._demonstration_pub = self.create_publisher(Demonstration, 'demonstration', 10)
        self._done_pub = self.create_publisher(FrameDone, 'frame_done', 100)
        self._marker_pub = self.create_publisher(MarkerArray, 'table_markers', 1)
        self._overlay_pub = self.create_publisher(Image, 'table_overlay', 1)
        self._diagnostics_pub = self.create_publisher(DiagnosticArray, '/diagnostics', 10)

        colour, depth = 'camera/rgb/image_rect_color', 'camera/depth_registered/image_rect'
        self.create_subscription(Image, colour, lambda m: self._on_image(0, m), CAMERA)
        self.create_subscription(Image, depth, lambda m: self._on_image(1, m), CAMERA)
        self.create_subscription(CameraInfo, 'camera/rgb/camera_info', self._on_info, CAMERA)
        self.create_timer(1.0, self._publish_diagnostics, clock=steady_clock())

    def _check_parameters(self, changes: list[Parameter]) -> SetParametersResult:
        try:
            read_settings(parameters.values(self, SETTINGS, changes))
        except (ValueError, TypeError, OSError) as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _start_anew(self, _: list[Parameter]) -> None:
        self._settings = read_settings(parameters.values(self, SETTINGS))
        self._pairing: StampPairing[Image] = StampPairing(
            self._settings.pairing_tolerance, lambda m: stamp_ns(m.header.stamp)
        )
        self._order = StampOrder()
        self._perception: TabletopPerception | None = None

    def _on_info(self, info: CameraInfo) -> None:
        try:
            intrinsics = messages.intrinsics_of(info)
        except ValueError as error:
            self._drop('bad camera_info', str(error))
            return
        if intrinsics != self._intrinsics:
            self._intrinsics, self._perception = intrinsics, None
        self._done_pub.publish(FrameDone(header=info.header, kind=FrameDone.CAMERA_INFO))

    def _on_image(self, stream: int, image: Image) -> None:
        alone = self._pairing.alone
        pair = self._pairing.add(stream, image)
        if self._pairing.alone > alone:
            here, missing = ('colour', 'depth') if stream == 0 else ('depth', 'colour')
            self._drop(f'{here} without {missing}', f'No {missing} image came with its stamp.')
        if pair is not None:
            self._on_pair(*pair)

    def _on_pair(self, colour: Image, depth: Image) -> None:
        begin = time.perf_counter()
        order = self._order.take(stamp_ns(depth.header.stamp))
        if order == 'older':
            self._refuse(depth, 'older than the last', 'a frame is older than the one before it')
            return
        if order == 'restart' and self._perception is not None:
            self._perception.reset_tracking()
            self.get_logger().info('Stamps went back: a new start. Objects are tracked anew.')
        if self._intrinsics is None:
            self._refuse(depth, 'no camera_info', 'no camera_info has come yet')
            return
        try:
            frame = messages.frame_of(colour, depth)
            if not frame.has_depth:
                raise NoDepthError(f'Expected depth readings, got 0 of {frame.depth.size}.')
            table = self._process(frame, self._intrinsics)
        except (ValueError, cv2.error) as error:
            self._refuse(depth, getattr(error, 'reason', FrameError.reason), str(error))
            return
        if table.learned:
            self._publish(table, frame, depth)
        self._done_pub.publish(messages.frame_read(table, depth.header))
        latency = (self.get_clock().now().nanoseconds - frame.stamp) * 1e-9
        self.counts.read(time.perf_counter() - begin, latency)

    def _refuse(self, depth: Image, reason: str, sentence: str) -> None:
        self._drop(reason, sentence)
        refused = FrameDone(header=depth.header, kind=FrameDone.REFUSED, reason=sentence)
        self._done_pub.publish(refused)

    def _process(self, frame: RgbdFrame, intrinsics: Intrinsics) -> TableObservation:
        if self._perception is None:
            config, catalogue, _ = self._settings
            self._perception = TabletopPerception(config, intrinsics, catalogue)
        learned_before = self._perception.background is not None
        table = self._perception.process(frame)
        if table.learned and not learned_before:
            names = ', '.join(o.name for o in table.objects)
            self.get_logger().info(f'Background learned. Watching the table for: {names}.')
        return table

    def _publish(self, table: TableObservation, frame: RgbdFrame, depth: Image) -> None:
        reference = self._settings.config.reference_frame
        self._table_pub.publish(messages.table_state(table, depth.header, reference))
        for act in table.demonstrations:
            self._demonstration_pub.publish(messages.demonstration(act, depth.header))
            self.get_logger().info(
                f'Seen: {act.object} from {act.x_i.name} to {act.x_f.name} by '
                f'{act.manner.name.lower()} ({act.manner_probability:.2f}).'
            )
        self._publish_pictures(table, frame, depth)

    def _publish_pictures(self, table: TableObservation, frame: RgbdFrame, depth: Image) -> None:
        """Markers and overlay, for those who listen, less often than frames come."""
        perception, header = self._perception, depth.header
        if perception is None or perception.background is None or perception.regions is None:
            return
        regions, reference = perception.regions, self._settings.config.reference_frame
        if self._marker_pub.get_subscription_count() and self._marker_times.due(frame.stamp):
            markers = messages.table_markers(table, reference, regions, header.stamp)
            self._marker_pub.publish(markers)
        if self._overlay_pub.get_subscription_count() and self._overlay_times.due(frame.stamp):
            image = draw(frame.rgb, table, perception.background.view, regions)
            self._overlay_pub.publish(messages.image_message(image, header))

    def _drop(self, reason: str, sentence: str) -> None:
        said = self.counts.drop(reason, sentence, time.monotonic())
        if said is not None:
            self.get_logger().warning(said)

    def _publish_diagnostics(self) -> None:
        facts = self.counts.described()
        if self._perception is not None:
            facts |= self._perception.described()
        facts['unpaired images'] = str(self._pairing.unpaired)
        learned = self._perception is not None and self._perception.background is not None
        rate, now = self.counts.rate(time.monotonic()), self.get_clock().now().to_msg()
        self._diagnostics_pub.publish(messages.diagnostics_message(rate, learned, facts, now))


def main() -> int:
    """Run the node until SIGINT or SIGTERM."""
    # Threads for images this small only wait for each other.
    cv2.setNumThreads(1)
    return run_node('perception_node', PerceptionNode)


if __name__ == '__main__':
    sys.exit(main())

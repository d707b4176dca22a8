"""The perception node: images in, table state and demonstrations out."""

from __future__ import annotations

import sys
import time
from copy import copy

import cv2
import numpy as np
from numpy.typing import NDArray
from rcl_interfaces.msg import SetParametersResult
from rclpy.lifecycle import LifecycleState, TransitionCallbackReturn
from rclpy.parameter import Parameter
from sensor_msgs.msg import CameraInfo, CompressedImage, Image
from std_srvs.srv import Trigger
from visualization_msgs.msg import MarkerArray

from likeme_core.heartbeats import NodeState, described
from likeme_core.ros import parameters
from likeme_core.ros.diagnostics import DiagnosticsPublisher
from likeme_core.ros.heartbeat import HeartbeatPublisher
from likeme_core.ros.managed_node import ManagedNode
from likeme_core.ros.qos import CAMERA, OVERRIDABLE
from likeme_core.ros.spin import join_graph, run_node
from likeme_core.ros.time import steady_clock
from likeme_core.ros.transforms import StaticTransforms
from likeme_core.ros.world import WorldPublisher, declare_world
from likeme_core.settings import Setting
from likeme_core.stamps import stamp_ns
from likeme_core.world.file import load_world_anew
from likeme_msgs.msg import Attempt, Demonstration, FrameDone, TableState
from likeme_perception import messages
from likeme_perception.frame_counts import FrameCounts, Throttle
from likeme_perception.frame_reader import FrameReader
from likeme_perception.health import FrameHealth
from likeme_perception.node_settings import read_settings, settings_of
from likeme_perception.observation import TableObservation
from likeme_perception.overlay import draw
from likeme_perception.pairing import StampPairing
from likeme_perception.rgbd import Intrinsics, RgbdFrame
from likeme_perception.table_check import CAMERA_MOVED

Pose = NDArray[np.float64]

CAMERA_FRAME_SETTING = Setting(
    True,
    "Whether tf_static has the camera's optical frame; false: its driver publishes it",
    read_only=True,
)
#: Type and topics of colour and depth by image_transport's name.
TRANSPORTS = {
    'raw': (Image, 'camera/rgb/image_rect_color', 'camera/depth_registered/image_rect'),
    'compressed': (
        CompressedImage, 'camera/rgb/image_rect_color/compressed',
        'camera/depth_registered/image_rect/compressedDepth',
    ),
}  # fmt: skip
TRANSPORT_SETTING = Setting(
    'raw',
    'raw, or compressed: colour and depth from the topics .../compressed and .../compressedDepth',
    read_only=True,
)
#: s between two log lines about a camera_info that changes.
CHANGE_LOG_PERIOD = 5.0


class PerceptionNode(ManagedNode):
    """Estimates the state of every object on the table from a registered RGB-D camera.

    | publishes | type | |
    | --- | --- | --- |
    | world | likeme_msgs/World | latched: what the numbers in messages mean |
    | table_state | likeme_msgs/TableState | per frame, once the background is known |
    | demonstration | likeme_msgs/Demonstration | a human act, when it is complete |
    | attempt | likeme_msgs/Attempt | a human act when it is under way, and when it has ended,
      wherever the object is then |
    | frame_done | likeme_msgs/FrameDone | each frame and camera_info, when processed |
    | table_markers | visualization_msgs/MarkerArray | 5 Hz while subscribed |
    | tf_static | tf2_msgs/TFMessage | table, regions, and where the camera is (as configured, then
      levelled to the table it saw), unless publish_camera_frame is false |
    | table_overlay | sensor_msgs/Image | the image with states, 2 Hz while subscribed |
    | /diagnostics | diagnostic_msgs/DiagnosticArray | 1 Hz: rate, latency, drops, health |
    | heartbeat | likeme_msgs/Heartbeat | 20 Hz: STARTING until the background is known, DEGRADED
      while no frame can be read |

    | subscribes | type | |
    | --- | --- | --- |
    | camera/rgb/image_rect_color | sensor_msgs/Image | rgb8 or bgr8 |
    | camera/depth_registered/image_rect | sensor_msgs/Image | 16UC1 mm or 32FC1 m |
    | camera/rgb/camera_info | sensor_msgs/CameraInfo | the latest is used |

    With image_transport "compressed" instead of the two images: sensor_msgs/CompressedImage on
    camera/rgb/image_rect_color/compressed (JPEG or PNG) and
    camera/depth_registered/image_rect/compressedDepth (PNG).

    | offers | type | |
    | --- | --- | --- |
    | perception/reset | std_srvs/Trigger | forget camera, background and objects; read
      `looks` in the world file anew |

    History, depth and reliability of the camera topics and of table_state:
    qos_overrides./TOPIC.subscription.* and .publisher.*.

    A managed node, active from the start unless `autostart` is false. While it is not active it
    publishes world, heartbeat and /diagnostics only; it begins anew when it is activated.

    Parameters: world, autostart, publish_camera_frame, image_transport, and
    node_settings.settings_of(world): every number of PerceptionConfig by its name (rectangles as
    x_min, x_max, y_min, y_max) and pairing_tolerance. A change restarts perception with the new
    values; invalid values are refused.
    """

    def __init__(self, parameter_overrides: list[Parameter] | None = None) -> None:
        super().__init__('perception_node', parameter_overrides=parameter_overrides)
        self._world = declare_world(self)
        self._declared = settings_of(self._world)
        parameters.declare(
            self,
            self._declared
            | {'publish_camera_frame': CAMERA_FRAME_SETTING, 'image_transport': TRANSPORT_SETTING},
        )
        self.add_on_set_parameters_callback(self._check_parameters)
        self.add_post_set_parameters_callback(self._apply_parameters)

        self.counts = FrameCounts(time.monotonic())
        self._health = FrameHealth(time.monotonic())
        self._marker_times, self._overlay_times = Throttle(0.2), Throttle(0.5)
        self._restart(None)

        self._world_pub = WorldPublisher(self, self._world)
        self._frames = StaticTransforms(self)
        self._publish_frames('', None)
        # Subscribers that act on it keep the newest one; recorders and monitors want each, and
        # what a writer has overwritten it cannot send again.
        self._table_pub = self.create_publisher(
            TableState, 'table_state', 10, qos_overriding_options=OVERRIDABLE
        )
        self._demonstration_pub = self.create_publisher(Demonstration, 'demonstration', 10)
        self._attempt_pub = self.create_publisher(Attempt, 'attempt', 10)
        self._done_pub = self.create_publisher(FrameDone, 'frame_done', 100)
        self._marker_pub = self.create_publisher(MarkerArray, 'table_markers', 1)
        self._overlay_pub = self.create_publisher(Image, 'table_overlay', 1)
        self._diagnostics_pub = DiagnosticsPublisher(self)

        image, colour, depth = self._transport()
        for kind, topic, receive in (
            (image, colour, lambda m: self._on_image(0, m)),
            (image, depth, lambda m: self._on_image(1, m)),
            (CameraInfo, 'camera/rgb/camera_info', self._on_info),
        ):
            # A copy: rclpy writes what is overridden into the profile.
            self.create_subscription(
                kind, topic, receive, copy(CAMERA), qos_overriding_options=OVERRIDABLE
            )
        self.create_service(Trigger, 'perception/reset', self._on_reset)
        self.create_timer(1.0, self._publish_diagnostics, clock=steady_clock())
        self._heartbeat = HeartbeatPublisher(self, self._state)
        self.autostart()

    def _transport(self) -> tuple[type[Image | CompressedImage], str, str]:
        name = self.get_parameter('image_transport').value
        if name not in TRANSPORTS:
            raise ValueError(f'Expected image_transport {" or ".join(TRANSPORTS)}, got {name!r}.')
        return TRANSPORTS[name]

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Learn the background, then watch."""
        self._restart(None)
        return super().on_activate(state)

    def _check_parameters(self, changes: list[Parameter]) -> SetParametersResult:
        try:
            read_settings(parameters.values(self, self._declared, changes), self._world)
        except (ValueError, TypeError, OSError) as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _apply_parameters(self, _: list[Parameter]) -> None:
        self._restart(self._reader.intrinsics)

    def _restart(self, intrinsics: Intrinsics | None) -> None:
        """Forget frames, background and objects."""
        settings = read_settings(parameters.values(self, self._declared), self._world)
        self._pairing: StampPairing[Image] = StampPairing(
            settings.pairing_tolerance, lambda image: stamp_ns(image.header.stamp)
        )
        self._reader, self._reason = FrameReader(settings, intrinsics), ''

    def _on_reset(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        of_world = self._read_world_anew()
        self._restart(None)
        response.success = True
        response.message = f'Perception waits for camera_info and frames.{of_world}'
        self.get_logger().info(f'Reset: the background is learned anew.{of_world}')
        return response

    def _read_world_anew(self) -> str:
        """Take over looks that were taught since the start; a sentence if the world is another."""
        try:
            world = load_world_anew(self.get_parameter('world').value)
        except ValueError as error:
            return f' The world file is as it was before: {error}'
        if world.digest != self._world.digest:
            return f' For {world.label}, as the file says now, start the cell anew.'
        self._world = world
        return ''

    def _on_info(self, info: CameraInfo) -> None:
        if not self.active:
            return
        done = FrameDone(header=info.header, kind=FrameDone.CAMERA_INFO)
        try:
            if self._reader.set_camera_info(info):
                self.get_logger().warning(
                    'camera_info changed: the background is learned anew.',
                    throttle_duration_sec=CHANGE_LOG_PERIOD,
                )
        except ValueError as error:
            self._count_drop('bad camera_info', str(error))
            done.reason = str(error)
        self._done_pub.publish(done)

    def _on_image(self, stream: int, image: Image) -> None:
        if not self.active:
            return
        alone = self._pairing.alone
        pair = self._pairing.add(stream, image)
        if self._pairing.alone > alone:
            here, missing = ('colour', 'depth') if stream == 0 else ('depth', 'colour')
            self._count_drop(f'{here} without {missing}', f'No {missing} image has its stamp.')
        if pair is not None:
            self._on_pair(*pair)

    def _on_pair(self, colour: Image, depth: Image) -> None:
        begin = time.perf_counter()
        result = self._reader.read(colour, depth)
        if result.restarted:
            self.get_logger().info('Stamps do not follow the last ones: objects are tracked anew.')
        table, frame = result.table, result.frame
        self._check_camera_frame(depth.header.frame_id)
        if table is None or frame is None:
            self._count_drop(result.reason, result.sentence)
            self._done_pub.publish(messages.frame_rejected(result.sentence, depth.header))
            return
        if result.background_learned:
            names = ', '.join(o.name for o in table.objects)
            self.get_logger().info(f'Background learned. Watching the table for: {names}.')
        if table.learned:
            self._publish(table, frame, depth)
        self._done_pub.publish(messages.frame_read(table, depth.header))
        now = self.get_clock().now().nanoseconds
        # Before the first /clock, simulated time is 0.
        latency = (now - frame.stamp) * 1e-9 if now else None
        self.counts.read(time.perf_counter() - begin, latency)
        self._health.read(time.monotonic())

    def _check_camera_frame(self, camera: str) -> None:
        """Publish where the camera is, if that has changed."""
        perception, config = self._reader.perception, self._reader.settings.config
        if not self.get_parameter('publish_camera_frame').value:
            return
        if perception is not None and perception.background is not None:
            pose: Pose | None = perception.background.view.pose
        else:
            pose = config.camera_pose()
        if camera and pose is not None and (camera, pose.tobytes()) != self._camera:
            self._publish_frames(camera, pose)

    def _publish_frames(self, camera: str, pose: Pose | None) -> None:
        reference = self._reader.settings.config.reference_frame
        stamp = self.get_clock().now().to_msg()
        frames = messages.cell_frames(self._world, reference, stamp)
        if pose is not None:
            frames.append(messages.camera_frame(reference, camera, pose, stamp))
        self._camera = (camera, b'' if pose is None else pose.tobytes())
        self._frames.publish(frames)

    def _publish(self, table: TableObservation, frame: RgbdFrame, depth: Image) -> None:
        self._log_reason(table.reason)
        reference = self._reader.settings.config.reference_frame
        self._table_pub.publish(messages.table_state(table, depth.header, reference, self._world))
        for act in table.demonstrations:
            self._demonstration_pub.publish(messages.demonstration(act, depth.header, self._world))
            self.get_logger().info(
                f'Seen: {act.object} from {act.x_i.name} to {act.x_f.name} by '
                f'{act.manner.name.lower()} ({act.manner_probability:.2f}).'
            )
        for attempt in table.attempts:
            self._attempt_pub.publish(messages.attempt(attempt, depth.header, self._world))
            if attempt.x_f == attempt.x_i:
                towards = (
                    f', towards {attempt.direction.name}' if attempt.direction is not None else ''
                )
                self.get_logger().info(
                    f'Tried: {attempt.object}{towards}; it is {attempt.x_i.name} as before.'
                )
        for unresolved in table.unresolved:
            of = f' on {unresolved.object}' if unresolved.object else ''
            self.get_logger().warning(f'Act{of} not understood: {unresolved.reason}.')
        self._publish_pictures(table, frame, depth)

    def _log_reason(self, reason: str) -> None:
        """One line when frames can no longer be read, and one when they can again."""
        if reason == self._reason:
            return
        self._reason = reason
        if not reason:
            self.get_logger().info('Frames can be read again.')
            return
        cure = '; call perception/reset when it rests' if reason == CAMERA_MOVED else ''
        self.get_logger().warning(f'All states are UNKNOWN: {reason}{cure}.')

    def _publish_pictures(self, table: TableObservation, frame: RgbdFrame, depth: Image) -> None:
        """Publish markers and overlay while subscribed, less often than frames come."""
        perception, header = self._reader.perception, depth.header
        if perception is None or perception.background is None:
            return
        reference = self._reader.settings.config.reference_frame
        if self._marker_pub.get_subscription_count() and self._marker_times.due(frame.stamp):
            markers = messages.table_markers(table, reference, self._world, header.stamp)
            self._marker_pub.publish(markers)
        if self._overlay_pub.get_subscription_count() and self._overlay_times.due(frame.stamp):
            image = draw(frame.rgb, table, perception.background.view, self._world)
            self._overlay_pub.publish(messages.image_message(image, header))

    def _count_drop(self, reason: str, sentence: str) -> None:
        self._health.drop(sentence)
        warning = self.counts.drop(reason, sentence, time.monotonic())
        if warning is not None:
            self.get_logger().warning(warning)

    def _state(self) -> tuple[NodeState, str]:
        if not self.active:
            return NodeState.STARTING, 'the node is not active'
        return self._health.state(self._reader, time.monotonic())

    def _publish_diagnostics(self) -> None:
        facts = self.counts.described() | {'health': described(*self._state())}
        if self._reader.perception is not None:
            facts |= self._reader.perception.described()
        facts['unpaired images'] = str(self._pairing.unpaired)
        rate, now = self.counts.rate(time.monotonic()), self.get_clock().now().to_msg()
        learned, reason = self._reader.background_learned, self._reader.reason
        self._diagnostics_pub.publish(
            messages.diagnostics_message(rate, learned, facts, now, reason)
        )


#: Of a standby process.
preload = join_graph


def main() -> int:
    """Run the node until SIGINT or SIGTERM."""
    # OpenCV's threads do not pay for images this small.
    cv2.setNumThreads(1)
    return run_node('perception_node', PerceptionNode)


if __name__ == '__main__':
    sys.exit(main())

"""ROS messages of the values of perception."""

from __future__ import annotations

from array import array
from collections.abc import Mapping

import numpy as np
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import Point, TransformStamped
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from sensor_msgs.msg import Image
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker, MarkerArray

from likeme_core.observations import Demonstration, ObservedAttempt
from likeme_core.ros.diagnostics import diagnostics_msg
from likeme_core.ros.time import time_msg
from likeme_core.ros.transforms import transform_msg
from likeme_core.world import World
from likeme_msgs.msg import Attempt, FrameDone, ObjectState, TableState
from likeme_msgs.msg import Demonstration as DemonstrationMsg
from likeme_msgs.msg import UnknownObject as UnknownObjectMsg
from likeme_perception.demonstration_fields import demonstration_fields
from likeme_perception.frame_counts import FrameRate
from likeme_perception.observation import ObjectObservation, TableObservation
from likeme_perception.overlay import state_colour
from likeme_perception.unknown_objects import UnknownObject


def table_state(
    table: TableObservation, header: Header, reference_frame: str, world: World
) -> TableState:
    """TableState in the reference frame, with the stamp of the depth image's header."""
    return TableState(
        header=Header(stamp=header.stamp, frame_id=reference_frame),
        world=world.label,
        reference_frame=reference_frame,
        camera_frame=header.frame_id,
        hand_in_view=table.hand_in_view,
        arm_in_view=table.arm_in_view,
        settled=table.settled,
        reason=table.reason,
        objects=[object_state(seen) for seen in table.objects],
        unknown_objects=[unknown_object(seen) for seen in table.unknown_objects],
    )


def unknown_object(seen: UnknownObject) -> UnknownObjectMsg:
    """UnknownObject of one that is none of the world's."""
    x, y, z = seen.shape.centroid
    return UnknownObjectMsg(
        name=seen.name,
        fits=seen.fits,
        unknown_probability=seen.probability,
        centroid=Point(x=x, y=y, z=z),
        major_axis_yaw=seen.shape.yaw,
        major_axis_length=seen.shape.length,
        minor_axis_length=seen.shape.width,
        height=seen.shape.height,
    )


def object_state(seen: ObjectObservation) -> ObjectState:
    """ObjectState of one observation."""
    x, y, z = seen.centroid
    message = ObjectState(
        name=seen.name,
        state=ObjectState.UNKNOWN if seen.state is None else int(seen.state),
        state_probability=list(seen.state_probability),
        visible=seen.visible,
        settled=seen.settled,
        centroid=Point(x=x, y=y, z=z),
        identity_probability=seen.identity_probability,
        last_seen=time_msg(seen.last_seen),
        reason=seen.reason,
    )
    if seen.shape is not None:
        message.major_axis_yaw = seen.shape.yaw
        message.major_axis_length = seen.shape.length
        message.minor_axis_length = seen.shape.width
        message.height = seen.shape.height
    return message


def demonstration(act: Demonstration, header: Header, world: World) -> DemonstrationMsg:
    """Demonstration with the header of the depth image that completed it."""
    times = {'start': time_msg(act.start), 'end': time_msg(act.end)}
    fields = demonstration_fields(act) | times
    return DemonstrationMsg(header=header, world=world.label, **fields)


def attempt(act: ObservedAttempt, header: Header, world: World) -> Attempt:
    """Attempt with the header of the depth image in which it was noticed."""
    return Attempt(
        header=header,
        world=world.label,
        object=act.object,
        manner=_number(act.manner),
        manner_probability=act.manner_probability,
        direction=_number(act.direction),
        x_i=int(act.x_i),
        x_f=_number(act.x_f),
        x_i_probability=list(act.x_i_probability),
        x_f_probability=list(act.x_f_probability),
        under_way=act.under_way,
        start=time_msg(act.start),
        end=time_msg(act.end),
    )


def _number(value: int | None) -> int:
    return Attempt.UNKNOWN if value is None else int(value)


def cell_frames(world: World, reference_frame: str, stamp: Time) -> list[TransformStamped]:
    """Frames `table` and `region_NAME`: the middle of each area, axes of the reference frame."""
    areas = {f'region_{e.state.name}': e.area for e in world.region_entries if e.area is not None}
    return [
        transform_msg(reference_frame, name, (*area.centre, 0.0), (0, 0, 0, 1), stamp)
        for name, area in ({'table': world.table.top} | areas).items()
    ]


def camera_frame(
    reference_frame: str, camera: str, pose: NDArray[np.float64], stamp: Time
) -> TransformStamped:
    """The optical frame of the camera; pose: 4x4, from it to the reference frame."""
    orientation = Rotation.from_matrix(pose[:3, :3]).as_quat()
    return transform_msg(reference_frame, camera, pose[:3, 3].tolist(), orientation, stamp)


def frame_read(table: TableObservation, header: Header) -> FrameDone:
    """FrameDone of a processed frame, sent after its table state and demonstrations."""
    return FrameDone(
        header=header,
        kind=FrameDone.READ,
        table_state=table.learned,
        demonstrations=len(table.demonstrations),
    )


def frame_rejected(sentence: str, header: Header) -> FrameDone:
    """FrameDone of a frame that was not read."""
    return FrameDone(header=header, kind=FrameDone.REFUSED, reason=sentence)


def image_message(rgb: np.ndarray, header: Header) -> Image:
    """An rgb8 image."""
    height, width = rgb.shape[:2]
    message = Image(header=header, height=height, width=width, encoding='rgb8', step=3 * width)
    message.data = array('B', np.ascontiguousarray(rgb).tobytes())
    return message


def diagnostics_message(
    rate: FrameRate, learned: bool, facts: Mapping[str, str], stamp: Time, reason: str = ''
) -> DiagnosticArray:
    """Diagnostics: level, summary and counts; reason: why all states are unknown, if they are."""
    level, summary = _status(rate, learned, reason)
    values = {'frame rate (Hz)': f'{rate.frames:.1f}', 'background learned': str(learned), **facts}
    name = 'likeme_perception: camera to table state'
    return diagnostics_msg(name, level, summary, values, stamp, 'camera')


def _status(rate: FrameRate, learned: bool, reason: str) -> tuple[bytes, str]:
    if rate.frames == 0 and rate.drops == 0:
        return DiagnosticStatus.STALE, 'no frames'
    if rate.drops:
        return DiagnosticStatus.WARN, f'{rate.drops} frames dropped in the last second'
    if reason:
        return DiagnosticStatus.WARN, f'all states are unknown: {reason}'
    if not learned:
        return DiagnosticStatus.WARN, 'learning the background'
    return DiagnosticStatus.OK, 'watching the table'


def table_markers(
    table: TableObservation, reference_frame: str, world: World, stamp: Time
) -> MarkerArray:
    """Markers of the regions' areas, and a sphere and a label per visible object."""
    header = Header(frame_id=reference_frame, stamp=stamp)
    markers = []
    for entry in world.region_entries:
        if entry.area is not None:
            corners = [(float(x), float(y)) for x, y in entry.area.corners()]
            outline = [*corners, corners[0]]
            markers.append(_line(header, int(entry.state), outline, entry.colour, 0.004))
    for k, seen in enumerate(table.objects):
        markers += _object_markers(header, k, seen, world)
    return MarkerArray(markers=markers)


def _object_markers(header: Header, k: int, seen: ObjectObservation, world: World) -> list[Marker]:
    sphere = Marker(header=header, ns='objects', id=k, type=Marker.SPHERE)
    label = Marker(header=header, ns='labels', id=k, type=Marker.TEXT_VIEW_FACING)
    if not seen.visible or seen.shape is None:
        sphere.action = label.action = Marker.DELETE
        return [sphere, label]
    x, y, z = seen.shape.centroid
    yaw = seen.shape.yaw
    for marker in (sphere, label):
        marker.color = _colour(state_colour(seen.state, world))
        marker.pose.position.x, marker.pose.position.y, marker.pose.position.z = x, y, z
    sphere.pose.orientation.z, sphere.pose.orientation.w = (
        float(np.sin(yaw / 2)),
        float(np.cos(yaw / 2)),
    )
    sphere.scale.x, sphere.scale.y = max(seen.shape.length, 0.01), max(seen.shape.width, 0.01)
    sphere.scale.z = max(seen.shape.height, 0.01)
    label.pose.position.z = z + 0.06
    label.scale.z = 0.03
    label.text = f'{seen.name} {seen.state_name}'
    return [sphere, label]


def _line(
    header: Header,
    k: int,
    points: list[tuple[float, float]],
    colour: tuple[int, int, int],
    width: float,
) -> Marker:
    marker = Marker(
        header=header, ns='regions', id=k, type=Marker.LINE_STRIP, color=_colour(colour)
    )
    marker.scale.x = width
    marker.pose.orientation.w = 1.0
    marker.points = [Point(x=x, y=y, z=0.001) for x, y in points]
    return marker


def _colour(rgb: tuple[int, int, int]) -> ColorRGBA:
    return ColorRGBA(r=rgb[0] / 255, g=rgb[1] / 255, b=rgb[2] / 255, a=0.9)

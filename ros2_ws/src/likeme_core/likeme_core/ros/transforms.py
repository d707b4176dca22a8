"""Coordinate frames for `tf` and `tf_static`."""

from __future__ import annotations

from collections.abc import Sequence

from builtin_interfaces.msg import Time
from geometry_msgs.msg import Quaternion, TransformStamped, Vector3
from rclpy.node import Node
from rclpy.publisher import Publisher
from tf2_msgs.msg import TFMessage

from likeme_core.ros.qos import LATCHED

#: As tf2 listeners expect it.
TF_DEPTH = 100


def transform_msg(
    parent: str,
    child: str,
    position: Sequence[float],
    orientation: Sequence[float],
    stamp: Time,
) -> TransformStamped:
    """The pose of the frame `child` in `parent`: position m, orientation quaternion xyzw."""
    x, y, z = map(float, position)
    qx, qy, qz, qw = map(float, orientation)
    message = TransformStamped(child_frame_id=child)
    message.header.frame_id, message.header.stamp = parent, stamp
    message.transform.translation = Vector3(x=x, y=y, z=z)
    message.transform.rotation = Quaternion(x=qx, y=qy, z=qz, w=qw)
    return message


def create_tf_publisher(node: Node) -> Publisher:
    """Publisher of `tf`, moving frames."""
    return node.create_publisher(TFMessage, 'tf', TF_DEPTH)


class StaticTransforms:
    """Publishes frames that do not move on `tf_static` (TFMessage, latched)."""

    def __init__(self, node: Node) -> None:
        self._publisher = node.create_publisher(TFMessage, 'tf_static', LATCHED)

    def publish(self, transforms: Sequence[TransformStamped]) -> None:
        """Replace all frames of this node: late subscribers receive one message."""
        self._publisher.publish(TFMessage(transforms=transforms))

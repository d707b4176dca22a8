"""The arm as tf2, RViz and Foxglove expect it: `robot_description`, `tf_static`, `tf`."""

from __future__ import annotations

from collections.abc import Iterable

import pybullet
from builtin_interfaces.msg import Time
from geometry_msgs.msg import TransformStamped
from rclpy.node import Node
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

from likeme_arm.messages import BASE_FRAME
from likeme_arm_sim.arm import BASE_LINK, Arm, ArmLink
from likeme_arm_sim.arm_description import arm_urdf
from likeme_arm_sim.physics_world import Pose
from likeme_core.ros.qos import LATCHED
from likeme_core.ros.transforms import StaticTransforms, create_tf_publisher, transform_msg


class ArmModel:
    """Publishes robot_description (String, latched), the fixed links once and the others on tf.

    The poses are those of bullet's links.
    """

    def __init__(self, node: Node, arm: Arm) -> None:
        self._arm = arm
        self._moving = tuple(link for link in arm.links if not link.fixed)
        self._description = node.create_publisher(String, 'robot_description', LATCHED)
        self._description.publish(String(data=arm_urdf()))
        self._static, self._tf = StaticTransforms(node), create_tf_publisher(node)
        stamp = node.get_clock().now().to_msg()
        base = transform_msg(BASE_FRAME, BASE_LINK, (0, 0, 0), (0, 0, 0, 1), stamp)
        self._static.publish(
            [base, *self._transforms((each for each in arm.links if each.fixed), stamp)]
        )

    def publish(self, stamp: Time) -> None:
        """Publish the links that joints move."""
        self._tf.publish(TFMessage(transforms=self._transforms(self._moving, stamp)))

    def _transforms(self, links: Iterable[ArmLink], stamp: Time) -> list[TransformStamped]:
        poses = self._arm.link_poses()
        return [
            transform_msg(link.parent, link.name, *_relative(poses, link), stamp) for link in links
        ]


def _relative(
    poses: dict[str, Pose], link: ArmLink
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Position and orientation of a link in its parent."""
    inverse = pybullet.invertTransform(*poses[link.parent])
    position, orientation = pybullet.multiplyTransforms(*inverse, *poses[link.name])
    return position, orientation

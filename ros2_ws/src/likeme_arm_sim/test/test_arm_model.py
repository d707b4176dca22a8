"""The arm's frames and its URDF, as tf2 and RViz read them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from urllib.parse import unquote, urlsplit
from xml.etree import ElementTree

import numpy as np
import pytest
import rclpy
from ament_index_python.packages import get_package_share_directory
from builtin_interfaces.msg import Time
from domain_coordinator import domain_id
from geometry_msgs.msg import TransformStamped
from rclpy.node import Node
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

from likeme_arm_sim import arm_description
from likeme_arm_sim.arm import Arm
from likeme_arm_sim.arm_description import arm_urdf
from likeme_arm_sim.kinematics import Kinematics
from likeme_arm_sim.physics_world import PhysicsWorld
from likeme_arm_sim.ros.arm_model import ArmModel
from likeme_arm_sim.toys import toys_of
from likeme_core.paper_world import WORLD
from likeme_core.ros.qos import LATCHED
from transforms import matrix

STAMP = Time(sec=3, nanosec=4)


@pytest.fixture
def node() -> Iterator[Node]:
    with domain_id() as domain:
        rclpy.init(domain_id=domain)
        made = Node('model_test')
        yield made
        made.destroy_node()
        rclpy.try_shutdown()


def test_the_frames_of_tf_lead_to_bullets_links(node: Node) -> None:
    world = PhysicsWorld(WORLD.table, toys_of(WORLD))
    arm = Arm(world.client, Kinematics(), world.step)
    heard: dict[str, list[TransformStamped]] = {'tf': [], 'tf_static': []}
    for topic, qos in (('tf', 10), ('tf_static', LATCHED)):
        node.create_subscription(
            TFMessage, topic, lambda m, kept=heard[topic]: kept.extend(m.transforms), qos
        )
    model = ArmModel(node, arm)
    # Elsewhere than when the fixed links were published.
    arm._jump(np.array([0.3, -0.4, 0.2, -1.9, 0.1, 1.8, 0.5]))
    model.publish(STAMP)
    for _ in range(100):
        rclpy.spin_once(node, timeout_sec=0.1)
        if all(heard.values()):
            break
    assert all(message.header.stamp == STAMP for message in heard['tf'])
    moving = {message.child_frame_id for message in heard['tf']}
    assert moving == {f'panda_link{k}' for k in range(1, 8)} | {
        'panda_leftfinger', 'panda_rightfinger'
    }  # fmt: skip
    frames = {m.child_frame_id: m for kept in heard.values() for m in kept}
    assert len(frames) == sum(map(len, heard.values())), 'a frame has one publisher'
    poses = arm.link_poses()
    for name in (link.name for link in arm.links):
        chain, frame = np.eye(4), name
        while frame != 'base_link':
            chain, frame = matrix(frames[frame]) @ chain, frames[frame].header.frame_id
        np.testing.assert_allclose(chain, poses[name].matrix(), atol=1e-6)


def test_a_late_subscriber_gets_the_description(node: Node) -> None:
    world = PhysicsWorld(WORLD.table, toys_of(WORLD))
    model = ArmModel(node, Arm(world.client, Kinematics(), world.step))
    heard: list[String] = []
    node.create_subscription(String, 'robot_description', heard.append, LATCHED)
    for _ in range(100):
        rclpy.spin_once(node, timeout_sec=0.1)
        if heard:
            break
    assert [message.data for message in heard] == [arm_urdf()]
    assert model is not None


def path_of(uri: str) -> Path:
    parts = urlsplit(uri)
    if parts.scheme == 'package':
        return Path(get_package_share_directory(parts.netloc) + parts.path)
    assert (parts.scheme, parts.netloc) == ('file', '')
    return Path(unquote(parts.path))


@pytest.mark.parametrize('installed', [True, False])
def test_every_mesh_resolves(installed: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    if not installed:
        monkeypatch.setattr(arm_description, 'FOLDER', 'not_there')
    root = ElementTree.fromstring(arm_urdf())
    uris = [mesh.attrib['filename'] for mesh in root.iter('mesh')]
    assert len(uris) == 22
    assert {uri.partition(':')[0] for uri in uris} == {'package' if installed else 'file'}
    assert not [uri for uri in uris if not path_of(uri).is_file()]


def test_the_licence_of_the_meshes_is_beside_them() -> None:
    folder = Path(get_package_share_directory('likeme_arm_sim'), arm_description.FOLDER)
    assert 'Apache License' in (folder / 'LICENSE.txt').read_text()

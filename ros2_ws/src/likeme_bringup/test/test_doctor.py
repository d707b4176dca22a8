"""What the doctor finds, on machines and ROS domains that lack something."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import AbstractContextManager
from itertools import count
from pathlib import Path

import pytest
import rclpy
from domain_coordinator import domain_id
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Image
from std_msgs.msg import String
from typer.testing import CliRunner

from likeme_bringup.doctor_checks import Finding, buffer_findings, machine_findings
from likeme_bringup.ros import graph_checks
from likeme_bringup.ros.doctor_command import app
from likeme_bringup.ros.graph_checks import graph_findings

SHIPPED = Path(__file__).parents[1] / 'config' / 'fastdds.xml'
BEST_EFFORT = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
PROFILE = """<dds xmlns="http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles">
  <receiveBufferSize>4194304</receiveBufferSize><segment_size>33554432</segment_size>
</dds>"""


@pytest.fixture
def environment(tmp_path: Path) -> dict[str, str]:
    """A healthy one, on a machine whose receive buffers may have 4 MiB."""
    (tmp_path / 'net' / 'core').mkdir(parents=True)
    for name in ('rmem_max', 'wmem_max'):
        (tmp_path / 'net' / 'core' / name).write_text('4194304\n')
    profile = tmp_path / 'profile.xml'
    profile.write_text(PROFILE)
    return {
        'ROS_DISTRO': 'jazzy',
        'RMW_IMPLEMENTATION': 'rmw_fastrtps_cpp',
        'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST',
        'FASTRTPS_DEFAULT_PROFILES_FILE': str(profile),
    }


def mended(environment: dict[str, str], proc: Path) -> list[Finding]:
    return [f for f in machine_findings(environment, proc, proc) if f.cure]


def test_a_healthy_machine_needs_nothing(environment: dict[str, str], tmp_path: Path) -> None:
    assert mended(environment, tmp_path) == []


def test_small_buffers_are_named_with_the_line_to_type(
    environment: dict[str, str], tmp_path: Path
) -> None:
    (tmp_path / 'net' / 'core' / 'rmem_max').write_text('212992\n')
    (finding,) = mended(environment, tmp_path)
    assert finding.line == (
        'mend  buffers      net.core.rmem_max is 212992, the profile asks for 4194304. '
        'Type: sudo sysctl -w net.core.rmem_max=4194304'
    )


def test_the_shipped_profile_asks_for_buffers_of_4_mib(tmp_path: Path) -> None:
    environment = {'FASTRTPS_DEFAULT_PROFILES_FILE': str(SHIPPED)}
    assert not any(finding.cure for finding in buffer_findings(environment, tmp_path))
    (tmp_path / 'net' / 'core').mkdir(parents=True)
    for name in ('rmem_max', 'wmem_max'):
        (tmp_path / 'net' / 'core' / name).write_text(f'{4 * 2**20 - 1}\n')
    cures = [finding.cure for finding in buffer_findings(environment, tmp_path)]
    assert cures == [
        'Type: sudo sysctl -w net.core.rmem_max=4194304',
        'Type: sudo sysctl -w net.core.wmem_max=4194304',
    ]
    for name in ('rmem_max', 'wmem_max'):
        (tmp_path / 'net' / 'core' / name).write_text(f'{4 * 2**20}\n')
    assert not any(finding.cure for finding in buffer_findings(environment, tmp_path))


@pytest.mark.parametrize(
    ('name', 'value', 'about'),
    [
        ('ROS_DISTRO', 'humble', 'environment'),
        ('RMW_IMPLEMENTATION', 'rmw_cyclonedds_cpp', 'environment'),
        ('ROS_DOMAIN_ID', '102', 'domain'),
        ('ROS_DOMAIN_ID', '-1', 'domain'),
        ('ROS_AUTOMATIC_DISCOVERY_RANGE', 'EVERYWHERE', 'discovery'),
        ('FASTRTPS_DEFAULT_PROFILES_FILE', '/no/such/file', 'dds profile'),
    ],
)
def test_each_wrong_setting_is_named(
    environment: dict[str, str], tmp_path: Path, name: str, value: str, about: str
) -> None:
    (finding,) = mended(environment | {name: value}, tmp_path)
    assert finding.about == about
    assert value in finding.sentence + finding.cure


def quiet_domain() -> AbstractContextManager[int]:
    """A domain that other tests do not use: nodes they killed are listed for 20 s more."""
    domain: AbstractContextManager[int] = domain_id(count(60).__next__)
    return domain


@pytest.fixture
def nodes(monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[Node, Node, Node]]:
    """The doctor's node and two others, found at once: they are of one process."""
    monkeypatch.setattr(graph_checks, 'DISCOVERY', 0.5)
    monkeypatch.setattr(graph_checks, 'MEASURING', 0.5)
    with quiet_domain() as domain:
        rclpy.init(domain_id=domain)
        made = Node('doctor'), Node('camera'), Node('perception_node')
        yield made
        for node in made:
            node.destroy_node()
        rclpy.try_shutdown()


def test_topics_are_listed_and_what_cannot_work_is_named(nodes: tuple[Node, Node, Node]) -> None:
    doctor, camera, perception = nodes
    for node in (camera, perception):
        node.create_publisher(Clock, '/clock', 1)
    camera.create_publisher(String, 'talk', BEST_EFFORT)
    perception.create_subscription(String, 'talk', print, 10)
    camera.create_publisher(String, 'fine', 10)
    for topic in ('camera/rgb/image_rect_color', 'camera/depth_registered/image_rect'):
        perception.create_subscription(Image, topic, print, BEST_EFFORT)
    camera.create_publisher(Image, 'camera/rgb/image_rect_color', 10)
    found = {finding.about: finding for finding in graph_findings(doctor)}
    assert found['cell'].sentence.endswith(': camera, perception_node.')
    assert 'two cells' in found['/clock'].cure
    assert found['/talk'].cure.startswith('perception_node does not receive it from camera (')
    assert found['/fine'].line == (
        'ok    /fine        0.0 Hz, std_msgs/msg/String, from camera (reliable).'
    )
    assert found['/camera/rgb/image_rect_color'].cure.startswith('No frame came')
    assert found['/camera/depth_registered/image_rect'].cure == (
        'perception_node waits for it: start what publishes it.'
    )


def test_without_a_cell_it_says_so_as_json(
    environment: dict[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(graph_checks, 'DISCOVERY', 0.2)
    environment.pop('FASTRTPS_DEFAULT_PROFILES_FILE')
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    with quiet_domain() as domain:
        told = CliRunner().invoke(app, ['--json', '--domain', str(domain)])
    findings = json.loads(told.stdout)
    assert told.exit_code == (0 if all(each['ok'] for each in findings) else 1)
    assert findings[-1] == {
        'ok': True, 'about': 'cell', 'cure': '',
        'sentence': f'No other node is on ROS domain {domain}.',
    }  # fmt: skip

"""cell.yaml says what the nodes declare, and ROS reads it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
import rclpy
import yaml
from rclpy.node import Node

pytestmark = pytest.mark.graph
ROOT = Path(__file__).parents[1]
CELL = ROOT / 'ros2_ws' / 'src' / 'likeme_bringup' / 'config' / 'cell.yaml'


def test_cell_yaml_is_what_the_nodes_declare(tmp_path: Path) -> None:
    written = tmp_path / 'cell.yaml'
    told = subprocess.run(
        [sys.executable, ROOT / 'tools' / 'cell_yaml.py', written],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert told.returncode == 0, told.stderr
    assert CELL.read_text(encoding='utf-8') == written.read_text(encoding='utf-8'), (
        f'Run: scripts/run.sh python tools/cell_yaml.py {CELL.relative_to(ROOT)}'
    )


@pytest.mark.parametrize('name', ['arm_driver', 'perception_node', 'inference_node', 'gaze_node'])
def test_ros_reads_it(name: str) -> None:
    written = yaml.safe_load(CELL.read_text(encoding='utf-8'))[name]['ros__parameters']
    context = rclpy.Context()
    rclpy.init(args=['--ros-args', '--params-file', str(CELL)], context=context)
    try:
        node = Node(name, context=context, automatically_declare_parameters_from_overrides=True)
        read = node.get_parameters_by_prefix('')
        node.destroy_node()
    finally:
        context.try_shutdown()
    assert written.keys() <= read.keys()
    for key, value in written.items():
        got = read[key].value
        assert (got if isinstance(value, str | int | float) else list(got)) == value

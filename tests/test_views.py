"""The RViz configuration and the Foxglove layout show what the nodes offer."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import rclpy
import yaml
from ament_index_python.packages import get_package_share_directory
from domain_coordinator import domain_id

from cell_yaml import node_class
from likeme_bringup.start_cell import MODULES
from likeme_core.ros.message_types import message_class

CONFIG = Path(get_package_share_directory('likeme_bringup'), 'config')
#: What a display of RViz needs under a key.
RVIZ_TYPES = {
    ('RobotModel', 'Description Topic'): 'std_msgs/msg/String',
    ('MarkerArray', 'Topic'): 'visualization_msgs/msg/MarkerArray',
    ('Image', 'Topic'): 'sensor_msgs/msg/Image',
    ('Camera', 'Topic'): 'sensor_msgs/msg/Image',
    ('DepthCloud', 'Depth Map Topic'): 'sensor_msgs/msg/Image',
    ('DepthCloud', 'Color Image Topic'): 'sensor_msgs/msg/Image',
}


@pytest.fixture(scope='module')
def offered(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Topics that the nodes of the cell publish, with their types."""
    found: dict[str, str] = {}
    with pytest.MonkeyPatch.context() as patch, domain_id() as domain:
        patch.setenv('LIKEME_STATE', str(tmp_path_factory.mktemp('state')))
        rclpy.init(domain_id=domain)
        try:
            for module in MODULES.values():
                node = node_class(module)()
                name = (node.get_name(), node.get_namespace())
                found |= {
                    t: types[0] for t, types in node.get_publisher_names_and_types_by_node(*name)
                }
                node.destroy_node()
        finally:
            rclpy.try_shutdown()
    return found


def rviz() -> Any:
    return yaml.safe_load((CONFIG / 'cell.rviz').read_text())['Visualization Manager']


def layout() -> Any:
    return json.loads((CONFIG / 'foxglove_layout.json').read_text())


def values(tree: Any, key: str) -> Iterator[Any]:
    """All values of a key, however deep."""
    if isinstance(tree, dict):
        yield from ([tree[key]] if key in tree else [])
        tree = list(tree.values())
    if isinstance(tree, list):
        for each in tree:
            yield from values(each, key)


def test_every_topic_of_rviz_is_offered_with_the_type_of_its_display(
    offered: dict[str, str],
) -> None:
    shown = 0
    for display in rviz()['Displays']:
        for key in (key for key in display if key.endswith('Topic')):
            topic = display[key]['Value'] if isinstance(display[key], dict) else display[key]
            kind = RVIZ_TYPES[display['Class'].removeprefix('rviz_default_plugins/'), key]
            assert offered.get(topic) == kind, (display['Name'], topic)
            shown += 1
    assert shown == 6
    # The displays of cameras take the camera_info beside their image.
    for camera in ('camera/rgb', 'camera/depth_registered'):
        assert offered[f'/{camera}/camera_info'] == 'sensor_msgs/msg/CameraInfo'


def test_the_fixed_frame_is_the_root_of_the_frames(offered: dict[str, str]) -> None:
    assert offered['/tf'] == offered['/tf_static'] == 'tf2_msgs/msg/TFMessage'
    assert rviz()['Global Options']['Fixed Frame'] == 'base_link'
    assert list(values(layout(), 'followTf')) == ['base_link']


def test_every_topic_of_foxglove_is_offered(offered: dict[str, str]) -> None:
    panels = layout()['configById']
    names = [
        *panels['3D!cell']['topics'], *values(panels, 'topic'), *values(panels, 'imageTopic'),
        *values(panels, 'calibrationTopic'), *values(panels, 'topicToRender'),
        *values(panels, 'topicPath'),
    ]  # fmt: skip
    assert len(names) == 9
    assert {name: offered.get(name) for name in names if name not in offered} == {}
    for topic in values(panels, 'imageTopic'):
        assert offered[topic] == 'sensor_msgs/msg/Image'


def test_every_plotted_field_is_in_its_message(offered: dict[str, str]) -> None:
    paths = [each['value'] for each in layout()['configById']['StateTransitions!story']['paths']]
    assert len(paths) == 5
    for path in paths:
        topic, field = path.split('.')
        kind: Any = message_class(offered[topic])
        assert field in kind.get_fields_and_field_types(), path


def test_every_panel_is_in_the_layout() -> None:
    def leaves(tree: Any) -> Iterator[str]:
        if isinstance(tree, str):
            yield tree
        else:
            yield from (*leaves(tree['first']), *leaves(tree['second']))

    assert sorted(leaves(layout()['layout'])) == sorted(layout()['configById'])

"""Changes of world files keep the rest of the text."""

from __future__ import annotations

import difflib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from likeme_core.camera_mount import CameraMount, camera_at
from likeme_core.world.edit import check_own_file, with_object, with_values, write_world
from likeme_core.world.file import WorldFileError, parse_world, world_path

THREE = world_path('three_bins')
TEXT = THREE.read_text(encoding='utf-8')
LOOKS = {
    'colour': [{'weight': 1.0, 'mean': [50.0, 1.0, 2.0], 'deviation': [1.0, 1.0, 1.0]}],
    'length': 0.05, 'width': 0.04, 'height': 0.03, 'area': 0.002,
}  # fmt: skip


def changed_lines(text: str) -> tuple[list[str], list[str]]:
    """Lines that are gone, and that are new."""
    lines = list(difflib.ndiff(TEXT.splitlines(), text.splitlines()))
    return [x[2:] for x in lines if x[0] == '-'], [x[2:] for x in lines if x[0] == '+']


@pytest.mark.parametrize('flow', [False, True])
def test_a_camera_is_replaced_and_completed(flow: bool) -> None:
    text = TEXT
    if flow:
        block = TEXT[TEXT.index('camera:') : TEXT.index('sides:')]
        line = 'camera: {position: [0.05, 0.38, 0.90], target: [0.44, -0.02, 0.0]}  # by hand\n\n'
        text = TEXT.replace(block, line)
    new = with_values(text, 'camera', {'position': [0.1, 0.2, 0.9], 'roll': 0.01})
    camera = parse_world(new, THREE).camera
    assert (camera.position, camera.target, camera.roll) == (
        (0.1, 0.2, 0.9), (0.44, -0.02, 0.0), 0.01,
    )  # fmt: skip
    if flow:
        assert '# by hand' in new
    else:
        gone, added = changed_lines(new)
        assert gone == ['  position: [0.05, 0.38, 0.90]']
        assert added == ['  position: [0.1, 0.2, 0.9]', '  roll: 0.01']


def test_an_object_is_added_at_the_end_and_replaced_where_it_is() -> None:
    new = with_object(TEXT, {'name': 'mug', 'looks': LOOKS})
    assert parse_world(new, THREE).objects == (*parse_world(TEXT, THREE).objects, 'mug')
    assert changed_lines(new)[0] == []
    again = with_object(new, {'name': 'cube', 'looks': LOOKS})
    world = parse_world(again, THREE)
    assert world.objects[3] == 'cube'
    assert world.object('cube').looks['length'] == 0.05
    assert world.object('plum').looks == parse_world(TEXT, THREE).object('plum').looks
    with pytest.raises(ValueError, match="lines that start with '- '"):
        with_object(yaml.safe_dump(yaml.safe_load(TEXT), default_flow_style=True), {'name': 'a'})


def test_an_invalid_change_leaves_the_file(tmp_path: Path) -> None:
    path = tmp_path / 'mine.yaml'
    text = TEXT.replace('meshes/', f'{THREE.parent}/meshes/')
    path.write_text(text, encoding='utf-8')
    with pytest.raises(WorldFileError, match='position'):
        write_world(path, with_values(text, 'camera', {'position': [99.0, 0.0, 1.0]}))
    assert path.read_text(encoding='utf-8') == text


def test_the_worlds_of_likeme_are_not_changed(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r'three_bins\.yaml, which comes with LikeMe'):
        check_own_file(THREE)
    with pytest.raises(ValueError, match=r'got .*chung2015'):
        check_own_file(tmp_path / 'chung2015')


UNIT = st.floats(-0.5, 0.5)


@given(UNIT, UNIT, st.floats(0.3, 2), UNIT, UNIT, st.floats(-3.1, 3.1))
def test_any_pose_over_the_table_is_said_by_position_target_and_roll(
    x: float, y: float, z: float, u: float, v: float, roll: float
) -> None:
    usual: Any = CameraMount((x, y, z), (u, v, 0.0), fx=600.0)
    pose = CameraMount((x, y, z), (u, v, 0.0), roll=roll).pose()
    again = camera_at(pose, usual)
    np.testing.assert_allclose(again.pose(), pose, atol=1e-9)
    assert again.fx == 600.0

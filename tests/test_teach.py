"""Teaching an object from views in the simulated cell: the file, the simulator, perception."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from likeme_arm_sim.cell import Cell, CellSettings
from likeme_core.world import World
from likeme_core.world.file import load_world, parse_world, world_path
from likeme_core.world.folder import WORLDS_FOLDER
from likeme_perception.catalogue import world_catalogue
from likeme_perception.config import world_config
from likeme_perception.image_pairs import read_frame, write_frame, write_intrinsics
from likeme_perception.rgbd import Intrinsics, RgbdFrame, depth_in_metres
from likeme_perception.single_frame import look_at
from likeme_perception.teaching import ViewCollector
from likeme_replay.camera_tools.teach import app

THREE = load_world('three_bins')
LENS = THREE.camera
CAMERA = Intrinsics(LENS.fx, LENS.fy, LENS.cx, LENS.cy, LENS.width, LENS.height)
PERIOD = 1 / 30


def cell_of(world: World, *names: str) -> Cell:
    return Cell(world.only(*names), 0, CellSettings(initial_states={}), arm_visible=False)


def frame_of(cell: Cell) -> RgbdFrame:
    cell.step(PERIOD)
    images = cell.frame()
    return RgbdFrame(
        round(cell.time * 1e9), 'camera', images.rgb, depth_in_metres(images.depth_mm)
    )


def turned(cell: Cell, count: int) -> Iterator[int]:
    """Lays the object elsewhere, turned, again and again."""
    states = [state for state in cell.world.states if state not in cell.world.out_of_reach]
    for k in range(count):
        cell.reset(list(cell.world.objects), [states[k % len(states)]], k)
        yield k


def views(name: str, folder: Path, count: int) -> Path:
    cell = cell_of(THREE, name)
    folder.mkdir()
    for k in turned(cell, count):
        write_frame(folder, f'view_{k}', frame_of(cell))
    write_intrinsics(folder, CAMERA)
    return folder


@pytest.fixture(scope='module')
def cube(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Six views of the cube."""
    return views('cube', tmp_path_factory.mktemp('of a') / 'cube', 6)


@pytest.fixture
def world(tmp_path: Path) -> Path:
    """A world that knows no cube."""
    text = world_path('three_bins').read_text(encoding='utf-8')
    begin, end = text.index('- name: cube'), text.index('- name: plum')
    text = re.sub(r'- \{object: cube.*\n', '', text[:begin] + text[end:])
    path = tmp_path / 'mine.yaml'
    path.write_text(text.replace('meshes/', f'{WORLDS_FOLDER}/meshes/'), encoding='utf-8')
    return path


def teach(*words: str | Path) -> Result:
    return CliRunner().invoke(app, [str(word) for word in words])


def taught(*words: str | Path) -> str:
    done = teach(*words)
    assert done.exit_code == 0, done.output
    return done.output


def refused(*words: str | Path, code: int = 1) -> str:
    done = teach(*words)
    assert done.exit_code == code, done.output
    last = done.output.splitlines()[-1]
    assert last.startswith('teach: ')
    return last


def test_a_taught_object_is_simulated_and_recognised(cube: Path, world: Path) -> None:
    said = taught('block', cube, '--world', world)
    assert 'block is taken for: block 1.00' in said
    assert 'for the simulator a box of the measured size' in said
    assert 'start the cell anew with --world' in said
    new = parse_world(world.read_text(encoding='utf-8'), world)
    assert new.objects == ('pear', 'chicken', 'banana', 'plum', 'block')
    simulation = new.object('block').simulation
    assert simulation is not None
    np.testing.assert_allclose(simulation['parts'][0]['box'], 0.05, atol=0.006)

    cell = cell_of(new, 'block', 'plum')
    cell.reset(['block', 'plum'], [new.state('LEFT'), new.state('RIGHT')], 7)
    table, _ = look_at(frame_of(cell), CAMERA, None, world_config(new), world_catalogue(new))
    found = {o.name: o.state_name for o in table.objects if o.visible}
    assert found == {'block': 'LEFT', 'plum': 'RIGHT'}
    assert table.object('block').identity_probability > 0.95


def test_nothing_is_written_by_a_check(cube: Path, world: Path) -> None:
    before = world.read_bytes()
    assert 'block is taken for: block 1.00' in taught('block', cube, '--world', world, '--check')
    assert world.read_bytes() == before


def test_two_of_a_kind_are_mixed_up(tmp_path: Path, world: Path) -> None:
    again = taught('plum_2', views('plum', tmp_path / 'plum', 5), '--world', world)
    (p,) = re.findall(r'plum_2 is taken for: .*plum (0\.\d+)', again)
    assert 0.3 < float(p) < 0.7
    checked = taught('plum', '--check', '--world', world)
    assert re.search(r'^plum_2 is taken for: plum 0\.[3-7]', checked, re.MULTILINE)
    assert 'pear' not in checked


def test_a_table_without_a_colour_gets_it(cube: Path, world: Path) -> None:
    text = world.read_text(encoding='utf-8')
    world.write_text(text.replace('  colour: [205, 179, 144]\n', '', 1), encoding='utf-8')
    taught('block', cube, '--world', world)
    colour = parse_world(world.read_text(encoding='utf-8'), world).table.colour
    np.testing.assert_allclose(colour, (205, 179, 144), atol=3)


def test_colours_are_those_under_the_light_of_the_file(
    cube: Path, world: Path, tmp_path: Path
) -> None:
    taught('block', cube, '--world', world)
    usual = parse_world(world.read_text(encoding='utf-8'), world).object('block').looks
    dim = tmp_path / 'dim'
    dim.mkdir()
    write_intrinsics(dim, CAMERA)
    for k in range(5):
        frame = read_frame(cube / f'view_{k}_color.png', cube / f'view_{k}_depth.png')
        darker = RgbdFrame(0, 'camera', (frame.rgb * 0.6).astype(np.uint8), frame.depth)
        write_frame(dim, f'view_{k}', darker)
    taught('block', dim, '--world', world)
    again = parse_world(world.read_text(encoding='utf-8'), world).object('block').looks
    np.testing.assert_allclose(again['colour'][0]['mean'], usual['colour'][0]['mean'], atol=4)


def test_views_are_taken_when_the_object_rests_in_another_pose() -> None:
    cell = cell_of(THREE, 'cube')
    collector = ViewCollector(world_config(THREE), CAMERA, THREE.table.colour)
    taken = []
    for k in turned(cell, 3):
        taken += [k for _ in range(18) if collector.add(frame_of(cell))]
    assert taken == [0, 1, 2]
    assert collector.waits_for == 'the object to be turned'


def test_what_cannot_be_learned(cube: Path, world: Path, tmp_path: Path) -> None:
    pair = [cube / f'view_0_{kind}.png' for kind in ('color', 'depth')]
    four = [*pair] * 4
    camera = ('--intrinsics', cube / 'intrinsics.json')
    before = world.read_bytes()
    assert 'at least 5 views of the object' in refused('a', *four, *camera, '--world', world)
    assert 'comes with LikeMe' in refused('a', cube, '--world', WORLDS_FOLDER / 'chung2015.yaml')
    assert 'name' in refused('no name', cube, '--world', world)
    assert "got 'zebra'" in refused('zebra', '--check', '--world', world)
    both = cell_of(THREE, 'cube', 'plum')
    both.reset(['cube', 'plum'], [THREE.state('LEFT'), THREE.state('RIGHT')], 1)
    write_frame(tmp_path, 'two', frame_of(both))
    write_intrinsics(tmp_path, CAMERA)
    assert 'two: Expected one object alone' in refused('a', tmp_path, '--world', world)
    assert world.read_bytes() == before
    assert '--world FILE' in refused('a', cube, code=2)
    assert 'either --live or' in refused('a', '--world', world, code=2)

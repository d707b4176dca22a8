"""The command `look`, and the overlay."""

from __future__ import annotations

import json
import os
from pathlib import Path

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner

from likeme_perception.blobs import mask_of
from likeme_perception.look import app, look_at, read_frame, read_intrinsics
from likeme_perception.overlay import draw

ROOT = Path(__file__).resolve().parents[4]
SHARED = Path(os.environ.get('LIKEME_SHARED', ROOT.parent / 'shared')) / 'data' / 'rgbd'
needs_real_frames = pytest.mark.skipif(
    not SHARED.is_dir(), reason=f'the real RGB-D frames are not at {SHARED}'
)


def save(frame, folder: Path, name: str) -> list[str]:
    """Write a frame as two images; their paths."""
    paths = [str(folder / f'{name}_color.png'), str(folder / f'{name}_depth.png')]
    cv2.imwrite(paths[0], frame.rgb[:, :, ::-1])
    cv2.imwrite(paths[1], np.nan_to_num(frame.depth * 1000).astype(np.uint16))
    return paths


@pytest.fixture
def intrinsics_file(tmp_path: Path) -> str:
    """The renderer's intrinsics."""
    path = tmp_path / 'intrinsics.json'
    path.write_text(json.dumps({'fx': 262.5, 'fy': 262.5, 'cx': 159.5, 'cy': 119.5}))
    return str(path)


def test_an_unknown_object_on_an_unknown_table_is_found(
    renderer, lemon, tmp_path, intrinsics_file
) -> None:
    images = save(renderer.frame(lemon(0.44, -0.02)), tmp_path, 'one')
    out = tmp_path / 'out.png'
    done = CliRunner().invoke(
        app, [*images, '--intrinsics', intrinsics_file, '--out', str(out), '--json']
    )
    assert done.exit_code == 0, done.output
    things = json.loads(done.output)['things']
    assert len(things) == 1
    assert abs(things[0]['length'] - 0.06) < 0.015
    assert cv2.imread(str(out)).shape == (480, 640, 3)


def test_a_hand_is_found_with_an_image_of_the_empty_table(
    renderer, forearm, tmp_path, intrinsics_file
) -> None:
    empty = save(renderer.frame(), tmp_path, 'empty')
    images = save(renderer.frame(forearm(0.5, 0.0, 0.08)), tmp_path, 'hand')
    options = ['--background-color', empty[0], '--background-depth', empty[1], '--json']
    done = CliRunner().invoke(app, [*images, *options, '--intrinsics', intrinsics_file])
    assert done.exit_code == 0, done.output
    assert json.loads(done.output)['hand_in_view']


def test_an_entry_for_the_catalogue_is_printed(renderer, lemon, tmp_path, intrinsics_file) -> None:
    images = save(renderer.frame(lemon(0.44, -0.02)), tmp_path, 'one')
    done = CliRunner().invoke(app, [*images, '--intrinsics', intrinsics_file, '--learn', 'banana'])
    assert done.output.startswith('- name: banana\n  looks:\n')
    assert done.output.endswith('\n# table.colour: [196, 164, 122]\n')


def test_a_missing_file_is_reported_in_one_line(tmp_path) -> None:
    done = CliRunner().invoke(app, [str(tmp_path / 'no.png'), str(tmp_path / 'no2.png')])
    assert done.exit_code == 1
    assert 'look: Expected an image' in done.output


def test_states_hand_and_arm_are_drawn(renderer, catalogue, lemon, forearm) -> None:
    perception = renderer.perception(catalogue)
    frame = renderer.frame(lemon(0.45, 0.15), forearm(0.5, -0.1, 0.1))
    seen = perception.process(frame)
    image = draw(frame.rgb, seen, perception.background.view, perception.config.world, 'before')
    assert image.shape == (480, 640, 3)
    plain = cv2.resize(frame.rgb, (640, 480), interpolation=cv2.INTER_CUBIC)
    changed = np.abs(image.astype(int) - plain).max(axis=2) > 30
    assert changed[seen.hand[len(seen.hand) // 2] // 320 * 2].any()
    assert 0.01 < changed.mean() < 0.5


@needs_real_frames
def test_real_objects_on_a_desk_are_segmented() -> None:
    camera = read_intrinsics(SHARED / 'mosd' / 'intrinsics.json', (480, 640))
    ious = []
    for color in sorted((SHARED / 'mosd').glob('*_color.png'))[:8]:
        frame = read_frame(color, Path(str(color).replace('color', 'depth')))
        _, perception = look_at(frame, camera)
        found = perception.background.foreground(frame) > 0
        label = cv2.imread(str(color).replace('color', 'label'), cv2.IMREAD_UNCHANGED) > 1
        ious.append((found & label).sum() / (found | label).sum())
    assert np.median(ious) > 0.97


@needs_real_frames
@pytest.mark.parametrize('name', ['human_puzzle_1', 'human_puzzle_3'])
def test_a_real_gloved_hand_is_found(name: str) -> None:
    folder = SHARED / 'hand'
    camera = read_intrinsics(folder / 'intrinsics.json', (480, 640))
    frame, empty = (
        read_frame(folder / f'{n}_color.png', folder / f'{n}_depth.png')
        for n in (name, 'empty_table_0')
    )
    table, _ = look_at(frame, camera, empty)
    assert table.hand_in_view
    red = frame.rgb[:, :, 0].astype(int) - frame.rgb[:, :, 1] > 60
    red = cv2.morphologyEx(red.astype(np.uint8), cv2.MORPH_OPEN, np.ones((9, 9)))
    _, labels, stats, _ = cv2.connectedComponentsWithStats(red)
    glove = labels == 1 + np.argmax(stats[1:, cv2.CC_STAT_AREA])
    assert mask_of(table.hand, frame.depth.shape)[glove].mean() > 0.75

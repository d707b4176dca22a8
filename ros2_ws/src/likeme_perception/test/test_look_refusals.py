"""Files and values that `look` cannot use: one sentence and exit code 1, never a traceback."""

from __future__ import annotations

import json
from contextlib import suppress
from dataclasses import fields
from pathlib import Path

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner, Result

from likeme_perception.config import PerceptionConfig, config_from
from likeme_perception.look import app

CAMERA = {'fx': 262.5, 'fy': 262.5, 'cx': 159.5, 'cy': 119.5}
PART = {'weight': 1.0, 'mean': [60.0, 0.0, 60.0], 'deviation': [2.0, 2.0, 2.0]}
ENTRY = {'colour': [PART], 'length': 0.06, 'width': 0.05, 'height': 0.04, 'area': 0.003}


@pytest.fixture
def images(renderer, lemon, tmp_path: Path) -> list[str]:
    """The paths of a colour and a depth image of one thing on a table."""
    frame = renderer.frame(lemon(0.44, -0.02))
    paths = [str(tmp_path / 'color.png'), str(tmp_path / 'depth.png')]
    cv2.imwrite(paths[0], frame.rgb[:, :, ::-1])
    cv2.imwrite(paths[1], np.nan_to_num(frame.depth * 1000).astype(np.uint16))
    return paths


def look(*arguments: str | Path) -> Result:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def refused(*arguments: str | Path) -> str:
    """The one sentence that is said."""
    done = look(*arguments)
    assert done.exit_code == 1, done.output
    assert isinstance(done.exception, SystemExit)
    assert done.output.startswith('look: ')
    assert done.output.count('\n') == 1
    return done.output


@pytest.mark.parametrize(
    ('out', 'why'),
    [
        ('not/there.png', 'got no folder'),
        ('folder', 'got a folder'),
        ('x.xyz', "Expected an image format like .png or .jpg, got 'x.xyz'."),
        ('x', "Expected an image format like .png or .jpg, got 'x'."),
        ('color.png/x.png', 'got no folder'),
    ],
)
def test_a_place_where_no_image_can_be_written(
    images: list[str], tmp_path: Path, out: str, why: str
) -> None:
    (tmp_path / 'folder').mkdir()
    assert why in refused(*images, '--out', tmp_path / out)


def test_a_picture_is_written_beside_a_learned_entry(images: list[str], tmp_path: Path) -> None:
    (tmp_path / 'i.json').write_text(json.dumps(CAMERA))
    out = tmp_path / 'out.png'
    done = look(*images, '--intrinsics', tmp_path / 'i.json', '--learn', 'lemon', '--out', out)
    assert done.exit_code == 0, done.output
    assert cv2.imread(str(out)) is not None


@pytest.mark.parametrize(
    ('content', 'why'),
    [
        (json.dumps(CAMERA | {'fx': None}), 'Expected fx in '),
        (json.dumps(CAMERA | {'cx': '320'}), "as a number, got '320'."),
        (json.dumps(CAMERA | {'cy': True}), 'as a number, got True.'),
        (json.dumps(CAMERA | {'cy': [1]}), 'as a number, got [1].'),
        (json.dumps(CAMERA | {'cx': float('nan')}), 'as a number, got nan.'),
        (json.dumps(CAMERA | {'cx': float('inf')}), 'Expected a finite'),
        (json.dumps(CAMERA | {'fy': 10**400}), 'as a number, got 1000'),
        (json.dumps(CAMERA | {'fx': 0}), 'Expected focal lengths above 0'),
        (json.dumps({'fx': 1}), "Expected 'cx' of"),
        (json.dumps(list(CAMERA.values())), 'got list.'),
        ('5', 'got int.'),
        ('null', 'got NoneType.'),
        ('', 'Expected JSON in'),
        ('fx: 525', 'Expected JSON in'),
        ('[' * 100_000, 'Expected JSON in'),
        (b'\xff\xfe\x00', 'Expected text in UTF-8 in'),
        (None, 'No such file'),
    ],
)
def test_intrinsics_of_another_kind(
    images: list[str], tmp_path: Path, content: str | bytes | None, why: str
) -> None:
    path = written(tmp_path / 'i.json', content)
    assert why in refused(*images, '--intrinsics', path)


@pytest.mark.parametrize(
    ('content', 'why'),
    [
        ('min_height: "0.01"', "Expected min_height as a number, got '0.01'."),
        ('min_height: null', 'Expected min_height as a number, got None.'),
        ('min_height: true', 'Expected min_height as a number, got True.'),
        ('min_height: .nan', 'Expected min_height as a number, got nan.'),
        ('table: 5', 'Expected table as a list of 4 numbers, got 5.'),
        ('table: [1, 2, 3]', 'Expected table as 4 numbers, got 3.'),
        ('table: [0, 1, 0, x]', "Expected table as a number, got 'x'."),
        ('camera_position: {x: 1}', "as a list of 3 numbers, got {'x': 1}."),
        ('camera_quaternion: null', 'as a list of 4 numbers, got None.'),
        ('camera_quaternion: [0, 0, 0, 0]', 'Expected a quaternion of length 1, got 0.'),
        ('background_frames: 1.5', 'as a whole number, got 1.5.'),
        ('empty_at_start: "no"', "as true or false, got 'no'."),
        ('human_sides: far', "Expected human_sides as a list of names, got 'far'."),
        ('human_sides: [1]', 'Expected human_sides as text, got 1.'),
        ('reference_frame: 3', 'Expected reference_frame as text, got 3.'),
        ('1: 2', 'as text, got 1.'),
        ('[]', 'got list.'),
        ('0', 'got int.'),
        ('a: 2001-99-99', 'Expected YAML in'),
        ('[' * 10_000, 'Expected YAML in'),
        (b'\xff\xfe\x00', 'Expected text in UTF-8 in'),
        (None, 'No such file'),
    ],
)
def test_settings_of_another_kind(
    images: list[str], tmp_path: Path, content: str | bytes | None, why: str
) -> None:
    path = written(tmp_path / 'k.yaml', content)
    assert why in refused(*images, '--config', path)


@pytest.mark.parametrize(
    'content', ['objects: 5', '5', 'objects:\n  1: {}', b'\xff\xfe\x00', None]
)
def test_a_file_that_is_no_world(
    images: list[str], tmp_path: Path, content: str | bytes | None
) -> None:
    refused(*images, '--world', written(tmp_path / 'c.yaml', content))


def test_a_background_of_another_size(images: list[str], tmp_path: Path) -> None:
    small = [tmp_path / 'small.png', tmp_path / 'small_depth.png']
    cv2.imwrite(str(small[0]), np.zeros((60, 80, 3), np.uint8))
    cv2.imwrite(str(small[1]), np.full((60, 80), 900, np.uint16))
    options = ['--background-color', small[0], '--background-depth', small[1]]
    assert 'Expected a background of 240x320, got 60x80.' in refused(*images, *options)


@pytest.mark.parametrize('wrong', ['folder', 'text'])
def test_a_file_that_is_no_image(images: list[str], tmp_path: Path, wrong: str) -> None:
    path = tmp_path / wrong
    if wrong == 'folder':
        path.mkdir()
    else:
        path.write_text('no image')
    assert 'Expected an image' in refused(path, images[1])
    assert 'Expected an image' in refused(images[0], path)


@pytest.mark.parametrize(
    'name', [field.name for field in fields(PerceptionConfig) if field.name != 'world']
)
def test_a_setting_of_any_type_is_read_or_refused(name: str) -> None:
    values = [None, True, 0, -1, 10**400, 0.5, float('nan'), '', '1', [], [1.0], ['far'], {}]
    for value in [*values, [[1]] * 3, [None] * 4, {'x': 1}, b'1']:
        with suppress(ValueError):
            config_from({name: value})


def written(path: Path, content: str | bytes | None) -> Path:
    """A file with that content; with None there is no file."""
    if isinstance(content, str):
        path.write_text(content)
    elif content is not None:
        path.write_bytes(content)
    return path

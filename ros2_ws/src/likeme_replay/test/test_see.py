"""The command `see`: images, recordings, refusals."""

from __future__ import annotations

import json
import re
from pathlib import Path
from shutil import copytree

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner, Result

from likeme_core.world.file import world_path
from likeme_core.world.folder import WORLDS_FOLDER
from likeme_replay.camera_tools.see import app

BAGS = Path(__file__).resolve().parents[4] / 'bags'
BAG = BAGS / 'pear_right_left_place'
CAMERA = {'fx': 525.0, 'fy': 525.0, 'cx': 319.5, 'cy': 239.5}


def see(*arguments: str | Path) -> Result:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def refused(*arguments: str | Path, code: int = 1) -> str:
    """The one sentence that is said."""
    done = see(*arguments)
    assert done.exit_code == code, done.output
    assert isinstance(done.exception, SystemExit)
    assert done.output.startswith('see: ')
    assert done.output.count('\n') == 1
    return done.output


@pytest.fixture(scope='module')
def pair(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the first picture of a recording as a pair."""
    folder = tmp_path_factory.mktemp('a pair')
    done = see(BAG, '--at', '0', '--out', folder / 'seen.png', '--save', folder / 'pairs')
    assert done.exit_code == 0, done.output
    assert cv2.imread(str(folder / 'seen.png')).shape == (960, 1280, 3)
    return folder / 'pairs'


@pytest.fixture(scope='module')
def images(pair: Path) -> list[Path]:
    """The two files of the pair."""
    return [pair / f'{BAG.name}_{kind}.png' for kind in ('color', 'depth')]


def test_a_recording_becomes_a_video(tmp_path: Path) -> None:
    done = see(BAG, '--out', tmp_path / 'a.mp4')
    assert done.exit_code == 0, done.output
    assert 'pear from RIGHT to LEFT by place' in done.output
    video = cv2.VideoCapture(str(tmp_path / 'a.mp4'))
    assert video.get(cv2.CAP_PROP_FPS) == pytest.approx(12, abs=0.1)
    assert video.get(cv2.CAP_PROP_FRAME_COUNT) > 60


def test_a_picture_of_a_recording_shows_the_hand(tmp_path: Path) -> None:
    done = see(BAG, '--at', '1.6', '--out', tmp_path / 'a.png', '--json')
    assert done.exit_code == 0, done.output
    told = json.loads(done.output)
    assert told['hand_in_view']
    assert told['hand_pixels'] > 1000


def test_a_pair_in_its_world_has_the_states_of_the_recording(pair: Path, tmp_path: Path) -> None:
    done = see(pair, '--world', 'chung2015', '--out', tmp_path / 'a.png', '--json')
    assert done.exit_code == 0, done.output
    states = {o['name']: o['state'] for o in json.loads(done.output)['objects']}
    assert states == {'pear': 'RIGHT', 'lemon': 'LEFT', 'chicken': 'RIGHT'}


def test_a_pair_without_a_world_has_unknown_objects(images: list[Path], tmp_path: Path) -> None:
    done = see(*images, '--out', tmp_path / 'a.png', '--json')
    assert done.exit_code == 0, done.output
    small = [t for t in json.loads(done.output)['unknown_objects'] if t['length'] < 0.1]
    assert len(small) == 3


def test_several_pairs_become_a_folder_of_pictures(images: list[Path], tmp_path: Path) -> None:
    done = see(*images, *images, '--out', tmp_path / 'all')
    assert done.exit_code == 0, done.output
    assert [path.name for path in (tmp_path / 'all').iterdir()] == [f'{BAG.name}.png']


def test_a_recording_in_a_world_that_it_does_not_fit(tmp_path: Path) -> None:
    world = tmp_path / 'moved.yaml'
    text = world_path('chung2015').read_text(encoding='utf-8')
    moved = re.sub(r'position: .*', 'position: [0.05, 0.38, 1.9]', text, count=1)
    assert moved != text
    world.write_text(moved, encoding='utf-8')
    copytree(WORLDS_FOLDER / 'meshes', tmp_path / 'meshes')
    said = refused(BAG, '--world', world, '--out', tmp_path / 'a.png')
    assert 'Expected frames that show a table at rest, got none of' in said
    assert 'is the camera pose right?' in said


@pytest.mark.parametrize(
    ('out', 'why'),
    [
        ('not/there.png', 'got no folder'),
        ('folder', 'got a folder'),
        ('x.xyz', "Expected an image format like .png or .jpg, got 'x.xyz'."),
        ('x', "Expected an image format like .png or .jpg, got 'x'."),
        ('not/there.mp4', 'got no such folder'),
    ],
)
def test_a_place_where_no_picture_can_be_written(tmp_path: Path, out: str, why: str) -> None:
    (tmp_path / 'folder').mkdir()
    assert why in refused(BAG, '--out', tmp_path / out)


def test_neither_or_both_of_live_and_images(images: list[Path]) -> None:
    for words in ((), ('--live', *images)):
        assert 'Expected either --live or images' in refused(*words, code=2)


def test_something_else_than_a_recording(images: list[Path], tmp_path: Path) -> None:
    assert 'There is no bag' in refused(tmp_path / 'gone')
    assert 'Expected a bag in' in refused(tmp_path)
    assert 'Expected a folder or a file .mcap' in refused(images[0])


@pytest.mark.parametrize(
    ('content', 'why'),
    [
        (json.dumps(CAMERA | {'fx': None}), 'Expected fx in '),
        (json.dumps(CAMERA | {'cx': '320'}), "as a number, got '320'."),
        (json.dumps(CAMERA | {'cx': float('inf')}), 'Expected a finite'),
        (json.dumps(CAMERA | {'fy': 10**400}), 'as a number, got 1000'),
        (json.dumps(CAMERA | {'fx': 0}), 'Expected focal lengths above 0'),
        (json.dumps({'fx': 1}), "Expected 'cx' of"),
        (json.dumps(list(CAMERA.values())), 'got list.'),
        ('', 'Expected JSON in'),
        ('[' * 100_000, 'Expected JSON in'),
        (b'\xff\xfe\x00', 'Expected text in UTF-8 in'),
        (None, 'No such file'),
    ],
)
def test_intrinsics_of_another_kind(
    images: list[Path], tmp_path: Path, content: str | bytes | None, why: str
) -> None:
    path = tmp_path / 'i.json'
    if isinstance(content, str):
        path.write_text(content)
    elif content is not None:
        path.write_bytes(content)
    assert why in refused(*images, '--intrinsics', path, '--out', tmp_path / 'a.png')


@pytest.mark.parametrize('content', ['objects: 5', '5', b'\xff\xfe\x00', None])
def test_a_file_that_is_no_world(
    images: list[Path], tmp_path: Path, content: str | bytes | None
) -> None:
    path = tmp_path / 'w.yaml'
    if content is not None:
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
    refused(*images, '--world', path)


def test_a_background_of_another_size(images: list[Path], tmp_path: Path) -> None:
    small = [tmp_path / 'small.png', tmp_path / 'small_depth.png']
    cv2.imwrite(str(small[0]), np.zeros((60, 80, 3), np.uint8))
    cv2.imwrite(str(small[1]), np.full((60, 80), 900, np.uint16))
    options = ['--background-color', small[0], '--background-depth', small[1]]
    assert 'Expected a background of 480x640, got 60x80.' in refused(*images, *options)
    assert 'got one.' in refused(*images, *options[:2])


@pytest.mark.parametrize('wrong', ['folder', 'text'])
def test_a_file_that_is_no_image(images: list[Path], tmp_path: Path, wrong: str) -> None:
    path = tmp_path / wrong
    if wrong == 'folder':
        path.mkdir()
    else:
        path.write_text('no image')
    assert 'Expected an image' in refused(path, images[1])
    assert 'Expected an image' in refused(images[0], path)

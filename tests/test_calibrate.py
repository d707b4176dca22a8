"""Calibration with the board in the simulated cell, and the command."""

from __future__ import annotations

import itertools
import re
from array import array
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import cv2
import numpy as np
import pytest
from builtin_interfaces.msg import Time
from scipy.spatial.transform import Rotation
from sensor_msgs.msg import CameraInfo, CompressedImage, Image
from std_msgs.msg import Header
from typer.testing import CliRunner, Result

from graph import Graph
from likeme_arm_sim.cell import Cell, CellSettings
from likeme_arm_sim.node_settings import sheets_on_table
from likeme_core.calibration_board import BOARD
from likeme_core.camera_mount import CameraMount
from likeme_core.paper_world import WORLD
from likeme_core.world.file import parse_world, world_path
from likeme_core.world.folder import WORLDS_FOLDER
from likeme_perception import board_detection
from likeme_perception.board_detection import find_board
from likeme_perception.calibration import BoardPlacement, CalibrationError, calibrate
from likeme_perception.image_pairs import write_frame, write_intrinsics
from likeme_perception.rgbd import Intrinsics, RgbdFrame, depth_in_metres
from likeme_replay.camera_tools.board_sheet import PAPERS, board_figure
from likeme_replay.camera_tools.calibrate import app

CAMERA = CameraMount((0.02, -0.25, 0.85), (0.45, 0.02, 0.0), roll=0.15)
INTRINSICS = Intrinsics(525.0, 525.0, 319.5, 239.5, 640, 480)
PLACE = (0.42, 0.03, 0.2)


def frames_of(board: str, count: int = 4) -> list[RgbdFrame]:
    """Frames of the cell by CAMERA, its objects beside the table."""
    world = replace(WORLD, camera=CAMERA)
    beside = CellSettings(initial_states=dict.fromkeys(world.objects, world.states[-1]))
    cell = Cell(world, 3, beside, lying=sheets_on_table(board))
    return [
        RgbdFrame(k, 'camera', images.rgb, depth_in_metres(images.depth_mm))
        for k, images in enumerate(cell.frame() for _ in range(count))
    ]


@pytest.fixture(scope='module')
def frames() -> list[RgbdFrame]:
    return frames_of('{} {} {}'.format(*PLACE))


def pose_of(frames: list[RgbdFrame], camera: Intrinsics = INTRINSICS) -> np.ndarray:
    return calibrate(frames, camera, BOARD, BoardPlacement(*PLACE), WORLD.table.top).pose


def test_the_pose_is_within_2_mm_and_a_fifth_of_a_degree(frames: list[RgbdFrame]) -> None:
    found, true = pose_of(frames), CAMERA.pose()
    assert np.linalg.norm(found[:3, 3] - true[:3, 3]) < 0.002
    turn = Rotation.from_matrix(found[:3, :3] @ true[:3, :3].T).as_rotvec()
    assert np.degrees(np.linalg.norm(turn)) < 0.2


def test_half_of_the_board_is_not_enough(frames: list[RgbdFrame]) -> None:
    corners = find_board(frames[0].rgb, BOARD).pixels
    middle = int(np.median(corners[:, 0]))
    covered = []
    for frame in frames:
        rgb = frame.rgb.copy()
        rgb[:, middle:] = 128
        covered.append(replace(frame, rgb=rgb))
    with pytest.raises(CalibrationError, match=r'at least 8 of .* 12 inner corners .* got [0-6]'):
        pose_of(covered)


def test_no_board_at_all(frames: list[RgbdFrame]) -> None:
    bare = [replace(frame, rgb=np.full_like(frame.rgb, 128)) for frame in frames[:2]]
    with pytest.raises(CalibrationError, match=r'got 0 in 2 frames \(0 of 10 markers\)'):
        pose_of(bare)


def test_a_board_that_moves(frames: list[RgbdFrame]) -> None:
    moved = [replace(f, rgb=np.roll(f.rgb, 2 * k, axis=1)) for k, f in enumerate(frames)]
    with pytest.raises(CalibrationError, match=r'at rest, got corners that move by \d+\.\d px'):
        pose_of(moved)


def test_a_focal_length_that_is_wrong(frames: list[RgbdFrame]) -> None:
    with pytest.raises(
        CalibrationError, match=r'as far by depth as by the board, .* got -9\.\d %'
    ):
        pose_of(frames, replace(INTRINSICS, fx=580.0, fy=580.0))


def test_depth_that_is_not_registered(frames: list[RgbdFrame]) -> None:
    nothing = [replace(f, depth=np.full_like(f.depth, np.nan)) for f in frames]
    with pytest.raises(CalibrationError, match='500 pixels or more, got 0'):
        pose_of(nothing)


@pytest.mark.parametrize('text', ['0.4', '1 2 x', '0 0 nan', ' '])
def test_a_board_that_lies_nowhere(text: str) -> None:
    with pytest.raises(ValueError, match=r"calibration_board like '0\.44 0\.0 0\.0', got"):
        sheets_on_table(text)


def test_the_markers_are_those_of_opencv() -> None:
    if not hasattr(cv2, 'aruco'):
        pytest.skip('this OpenCV has no aruco')
    aruco = cast(Any, cv2.aruco)
    draw = getattr(aruco, 'generateImageMarker', None) or aruco.drawMarker
    dictionary = aruco.getPredefinedDictionary(aruco.DICT_4X4_50)
    for number in range(BOARD.markers):
        corners = BOARD.marker_corners(number)
        across = BOARD.width / 2 - corners[0, 1] + BOARD.marker * (np.arange(6) + 0.5) / 6
        down = BOARD.height / 2 - corners[0, 0] + BOARD.marker * (np.arange(6) + 0.5) / 6
        u, v = np.meshgrid(across, down)
        ours = BOARD.is_black(u.ravel(), v.ravel()).reshape(6, 6)
        np.testing.assert_array_equal(ours, draw(dictionary, number, 6) == 0)


def test_either_api_of_opencv_is_called(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of 4.7 on: classes. Of 4.6: functions; OpenCV 4.6 itself runs with --noble."""

    class Old:
        DICT_4X4_50 = 0

        class DetectorParameters_create:  # noqa: N801
            pass

        @staticmethod
        def getPredefinedDictionary(name: int) -> str:  # noqa: N802
            return f'dictionary {name}'

        @staticmethod
        def detectMarkers(image: Any, dictionary: str, parameters: Any) -> Any:  # noqa: N802
            assert dictionary == 'dictionary 0'
            assert parameters.minMarkerPerimeterRate < 0.03
            return [], None, []

    nothing = np.zeros((48, 64, 3), np.uint8)
    monkeypatch.setattr(board_detection.cv2, 'aruco', Old, raising=False)
    assert find_board(nothing, BOARD).markers == 0
    monkeypatch.delattr(board_detection.cv2, 'aruco')
    with pytest.raises(ValueError, match='with contrib'):
        find_board(nothing, BOARD)


@pytest.mark.parametrize('paper', PAPERS, ids=lambda paper: paper.name)
def test_the_sheet_is_true_to_scale(paper: Any, tmp_path: Path) -> None:
    figure = board_figure(BOARD, paper)
    dots = 254
    figure.savefig(tmp_path / 'board.png', dpi=dots)
    image = cv2.imread(str(tmp_path / 'board.png'))
    assert image.shape[:2] == (round(paper.height * 10), round(paper.width * 10))
    view = find_board(cv2.resize(image, None, fx=0.5, fy=0.5), BOARD)
    assert (view.markers, len(view.corners)) == (BOARD.markers, len(BOARD.corners))
    grid = (view.pixels * 2 + 0.5).reshape(BOARD.rows - 1, BOARD.columns - 1, 2) / 10
    np.testing.assert_allclose(np.diff(grid[:, :, 0], axis=1), 48.0, atol=0.1)
    np.testing.assert_allclose(np.diff(grid[:, :, 1], axis=0), 48.0, atol=0.1)
    np.testing.assert_allclose(
        grid.reshape(-1, 2).mean(axis=0), (paper.width / 2, paper.height / 2), atol=0.15
    )


def run(*words: str | Path | float) -> Result:
    return CliRunner().invoke(app, [str(word) for word in words])


@pytest.fixture
def pairs(frames: list[RgbdFrame], tmp_path: Path) -> Path:
    folder = tmp_path / 'my pairs'
    folder.mkdir()
    for k, frame in enumerate(frames[:4]):
        write_frame(folder, f'view_{k}', frame)
    write_intrinsics(folder, INTRINSICS)
    return folder


@pytest.fixture
def world(tmp_path: Path) -> Path:
    path = tmp_path / 'mine.yaml'
    text = world_path('chung2015').read_text(encoding='utf-8')
    path.write_text(text.replace('meshes/', f'{WORLDS_FOLDER}/meshes/'), encoding='utf-8')
    return path


def test_a_folder_of_pairs_calibrates_a_world_file(
    pairs: Path, world: Path, tmp_path: Path
) -> None:
    place = ('--x', PLACE[0], '--y', PLACE[1], '--yaw', np.degrees(PLACE[2]))
    done = run(pairs, '--world', world, *place, '--out', tmp_path / 'seen.png')
    assert done.exit_code == 0, done.output
    assert re.search(r'12 of 12 corners in 4 frames, reprojection error 0\.\d\d px', done.output)
    assert cv2.imread(str(tmp_path / 'seen.png')) is not None
    camera = parse_world(world.read_text(encoding='utf-8'), world).camera
    assert np.linalg.norm(np.subtract(camera.position, CAMERA.position)) < 0.003
    assert abs(camera.roll - CAMERA.roll) < 0.004


def test_nothing_is_written_without_a_board(pairs: Path, world: Path) -> None:
    for path in pairs.glob('*_color.png'):
        cv2.imwrite(str(path), np.full((480, 640, 3), 128, np.uint8))
    before = world.read_bytes()
    done = run(pairs, '--world', world)
    assert done.exit_code == 1
    assert done.output.startswith('calibrate: Expected at least 8 of')
    assert done.output.count('\n') == 1
    assert world.read_bytes() == before


def test_touched_points_calibrate_a_world_file(world: Path, tmp_path: Path) -> None:
    base = np.array([[0.3, -0.2, 0], [0.3, 0.2, 0], [0.6, 0, 0], [0.4, 0, 0.1], [0.5, 0.2, 0.05]])
    pose = CAMERA.pose()
    seen = (base - pose[:3, 3]) @ pose[:3, :3]
    np.savetxt(
        tmp_path / 'p.csv', np.hstack([base, seen]), delimiter=',', comments='',
        header='x,y,z,camera_x,camera_y,camera_z',
    )  # fmt: skip
    done = run('--points', tmp_path / 'p.csv', '--world', world)
    assert done.exit_code == 0, done.output
    assert 'Points: 5, 0.0 mm from where' in done.output
    camera = parse_world(world.read_text(encoding='utf-8'), world).camera
    np.testing.assert_allclose(camera.pose(), pose, atol=2e-4)
    assert run('--points', tmp_path / 'gone.csv').exit_code == 1


@pytest.mark.graph
@pytest.mark.parametrize('compressed', [False, True])
def test_a_running_camera_is_calibrated(
    frames: list[RgbdFrame], tmp_path: Path, compressed: bool
) -> None:
    colour, depth = ('/compressed', '/compressedDepth') if compressed else ('', '')
    image = CompressedImage if compressed else Image
    place = ['--x', str(PLACE[0]), '--y', str(PLACE[1]), '--yaw', str(np.degrees(PLACE[2]))]
    with Graph(tmp_path) as graph:
        send = {
            topic: graph.node.create_publisher(kind, f'camera/{topic}', 5)
            for topic, kind in (
                (f'rgb/image_rect_color{colour}', image),
                (f'depth_registered/image_rect{depth}', image),
                ('rgb/camera_info', CameraInfo),
            )
        }
        stamps = itertools.count(1)

        def publish() -> None:
            stamp = Time(sec=next(stamps))
            messages = messages_of(frames[0], stamp)
            if compressed:
                messages = (*compressed_images_of(frames[0], stamp), messages[2])
            for topic, message in zip(send, messages, strict=True):
                send[topic].publish(message)

        graph.node.create_timer(0.1, publish)
        run = graph.start(
            'likeme_replay.camera_tools.calibrate', '--live', '--frames', '3', *place,
            '--out', str(tmp_path / 'a.png'),
        )  # fmt: skip
        graph.until(lambda: not run.alive, 20, 'its end')
        assert run.wait(1) == 0, run.said
        assert '12 of 12 corners in 3 frames' in run.said


def compressed_images_of(frame: RgbdFrame, stamp: Time) -> tuple[CompressedImage, CompressedImage]:
    """Colour as PNG, and depth in mm as image_transport's compressedDepth has it."""
    header = Header(stamp=stamp, frame_id='camera')
    colour = CompressedImage(header=header, format='rgb8; png compressed bgr8')
    colour.data = array('B', cv2.imencode('.png', frame.rgb[..., ::-1])[1].tobytes())
    depth = CompressedImage(header=header, format='16UC1; compressedDepth png')
    millimetres = np.nan_to_num(frame.depth * 1000).astype(np.uint16)
    depth.data = array('B', bytes(12) + cv2.imencode('.png', millimetres)[1].tobytes())
    return colour, depth


def messages_of(frame: RgbdFrame, stamp: Time) -> tuple[Image, Image, CameraInfo]:
    """Colour, depth and camera_info of a frame."""
    header = Header(stamp=stamp, frame_id='camera')
    colour = Image(header=header, height=480, width=640, encoding='rgb8', step=1920)
    colour.data = array('B', frame.rgb.tobytes())
    depth = Image(header=header, height=480, width=640, encoding='32FC1', step=2560)
    depth.data = array('B', frame.depth.tobytes())
    info = CameraInfo(header=header, height=480, width=640)
    info.k = [525.0, 0.0, 319.5, 0.0, 525.0, 239.5, 0.0, 0.0, 1.0]
    return colour, depth, info


def test_what_is_refused(pairs: Path, tmp_path: Path) -> None:
    assert run().exit_code == 2
    assert 'comes with LikeMe' in run(pairs, '--world', WORLDS_FOLDER / 'chung2015.yaml').output
    (pairs / 'intrinsics.json').unlink()
    assert 'intrinsics.json or --intrinsics, got neither' in run(pairs).output


def test_the_board_is_printed_for_both_papers(tmp_path: Path) -> None:
    done = run('--print', tmp_path / 'sheets')
    assert done.exit_code == 0, done.output
    for paper in PAPERS:
        data = (tmp_path / 'sheets' / f'board_{paper.name}.pdf').read_bytes()
        box = re.search(rb'/MediaBox \[ 0 0 ([\d.]+) ([\d.]+) \]', data)
        assert box is not None
        size = [float(value) * 25.4 / 72 for value in box.groups()]
        np.testing.assert_allclose(size, (paper.width, paper.height), atol=0.05)

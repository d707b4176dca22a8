"""Camera pose from touched points."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from likeme_core.camera_mount import CameraMount
from likeme_perception.calibration import CalibrationError
from likeme_perception.touched_points import COLUMNS, pose_of_touched_points, read_points

POSE = CameraMount((0.05, 0.38, 0.9), (0.44, -0.02, 0.0), roll=0.1).pose()


def touched(count: int, noise: float, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    base = rng.uniform((0.25, -0.3, 0.0), (0.65, 0.3, 0.2), (count, 3))
    seen = (base - POSE[:3, 3]) @ POSE[:3, :3]
    return base, seen + rng.normal(0, noise, seen.shape)


def test_exact_points_give_the_exact_pose() -> None:
    found = pose_of_touched_points(*touched(4, 0.0))
    np.testing.assert_allclose(found.pose, POSE, atol=1e-9)
    assert found.left_out < 1e-9


def test_points_in_one_plane_give_no_mirror_image() -> None:
    base, _ = touched(5, 0.0)
    base[:, 2] = 0.0
    found = pose_of_touched_points(base, (base - POSE[:3, 3]) @ POSE[:3, :3])
    np.testing.assert_allclose(found.pose, POSE, atol=1e-9)


def test_the_error_is_told_of_points_that_were_not_used() -> None:
    ratios = []
    for seed in range(30):
        found = pose_of_touched_points(*touched(8, 0.002, seed))
        base, seen = touched(200, 0.002, seed + 1000)
        new = np.linalg.norm(seen @ found.pose[:3, :3].T + found.pose[:3, 3] - base, axis=1)
        ratios.append(found.left_out / np.sqrt(np.mean(new**2)))
        turn = Rotation.from_matrix(found.pose[:3, :3] @ POSE[:3, :3].T).as_rotvec()
        assert np.degrees(np.linalg.norm(turn)) < 2.0
    assert 0.8 < np.median(ratios) < 1.4


@pytest.mark.parametrize(
    ('change', 'why'),
    [
        (lambda b, c: (b[:3], c[:3]), 'at least 4 points, got 3'),
        (lambda b, c: (b * (1, 0, 0), c), r'30 mm or more off one line, got 0 mm'),
        (lambda b, c: (b + np.eye(6)[:, :3] * 0.2, c), r'within 20 mm, got \d+ mm at point \d'),
    ],
)
def test_points_that_tell_no_pose(change, why: str) -> None:
    with pytest.raises(CalibrationError, match=why):
        pose_of_touched_points(*change(*touched(6, 0.0)))


def test_points_are_read_from_a_file(tmp_path: Path) -> None:
    path = tmp_path / 'points.csv'
    path.write_text(f'{",".join(COLUMNS)}\n1,2,3,4,5,6\n', encoding='utf-8')
    base, camera = read_points(path)
    assert (base.tolist(), camera.tolist()) == ([[1, 2, 3]], [[4, 5, 6]])
    for text, why in (
        ('x,y,z\n1,2,3\n', 'got no camera_x'),
        (f'{",".join(COLUMNS)}\n1,2,3,4,5,six\n', 'csv:2: Expected six finite numbers'),
        (f'{",".join(COLUMNS)}\n1,2,3\n', 'csv:2: Expected six finite numbers'),
        ('', 'got no x'),
    ):
        path.write_text(text, encoding='utf-8')
        with pytest.raises(ValueError, match=why):
            read_points(path)

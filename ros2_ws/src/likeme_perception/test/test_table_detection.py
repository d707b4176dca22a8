"""Table plane, camera pose and background."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from likeme_perception.background import BackgroundLearner
from likeme_perception.camera_view import CameraView, levelled, pose_from_plane
from likeme_perception.config import PerceptionConfig
from likeme_perception.errors import NoTableError
from likeme_perception.pipeline import TabletopPerception
from likeme_perception.plane import Plane, least_squares_plane, ransac_plane
from likeme_perception.rgbd import RgbdFrame


def tilted(rng: np.random.Generator, count: int) -> np.ndarray:
    """Points of a plane 0.9 m from the camera, tilted by 30 degrees, with 2 mm noise."""
    xy = rng.uniform(-0.4, 0.4, (count, 2))
    z = 0.9 - np.tan(np.radians(30)) * xy[:, 1] + rng.normal(0, 0.002, count)
    return np.column_stack([xy, z])


def test_ransac_finds_the_plane_among_a_third_of_other_points() -> None:
    rng = np.random.default_rng(0)
    clutter = rng.uniform(-0.4, 0.4, (600, 3)) + np.array([0, 0, 0.6])
    plane = ransac_plane(np.concatenate([tilted(rng, 1200), clutter]), np.random.default_rng(1))
    expected = np.array([0.0, -np.sin(np.radians(30)), -np.cos(np.radians(30))])
    angle = np.degrees(np.arccos(np.clip(np.dot(plane.normal, expected), -1, 1)))
    assert angle < 0.5
    assert plane.offset == pytest.approx(0.9 * np.cos(np.radians(30)), abs=0.003)


def test_the_normal_points_at_the_camera() -> None:
    plane = least_squares_plane(tilted(np.random.default_rng(2), 200))
    assert plane.height(np.zeros((1, 3)))[0] > 0


def test_too_few_points_are_refused() -> None:
    with pytest.raises(ValueError, match='at least 3 points for a plane, got 2'):
        least_squares_plane(np.zeros((2, 3)))
    with pytest.raises(ValueError, match='at least 30 points with depth for a plane, got 5'):
        ransac_plane(np.zeros((5, 3)), np.random.default_rng(0))


def test_levelling_makes_the_measured_plane_the_table(renderer) -> None:
    pose = renderer.view.pose
    wrong = pose.copy()
    wrong[2, 3] += 0.02
    normal = pose[2, :3]
    level = levelled(wrong, Plane(tuple(normal), float(pose[2, 3])))
    np.testing.assert_allclose(level[:3, :3], pose[:3, :3], atol=1e-9)
    assert level[2, 3] == pytest.approx(pose[2, 3])


def test_a_pose_from_the_plane_alone_puts_the_origin_under_the_optical_axis(renderer) -> None:
    plane = Plane(tuple(renderer.view.pose[2, :3]), float(renderer.view.pose[2, 3]))
    view = CameraView(renderer.intrinsics, pose_from_plane(plane))
    centre = view.project(np.zeros((1, 3)))[0]
    np.testing.assert_allclose(centre, [159.5, 119.5], atol=1e-6)
    above = view.project(np.array([[0.1, 0.0, 0.0]]))[0]
    assert above[1] < centre[1]


def test_pixels_and_points_are_inverse(renderer) -> None:
    view = renderer.view
    depth = np.float32([0.9, 1.0])
    points = view.points(np.array([100 * 320 + 40, 150 * 320 + 200]), depth)
    np.testing.assert_allclose(view.project(points), [[40, 100], [200, 150]], atol=1e-3)


def test_background_is_learned_with_things_on_the_table(renderer, lemon) -> None:
    learner = BackgroundLearner(renderer.config, renderer.intrinsics)
    found = [learner.add(renderer.frame(lemon(0.45, 0.1))) for _ in range(5)]
    assert found[:4] == [None] * 4
    background = found[4]
    assert background is not None
    assert background.foreground(renderer.frame()).sum() < 10
    assert background.foreground(renderer.frame(lemon(0.45, 0.1))).sum() > 100


def test_learning_restarts_until_nothing_moves(renderer, forearm) -> None:
    learner = BackgroundLearner(renderer.config, renderer.intrinsics)
    moving = [learner.add(renderer.frame(forearm(0.4, -0.3 + 0.12 * k, 0.1))) for k in range(5)]
    assert moving[-1] is None
    assert learner.restarts == 1
    still = [learner.add(renderer.frame()) for _ in range(5)]
    assert still[-1] is not None


def test_a_camera_pose_that_does_not_see_the_table_is_refused(renderer) -> None:
    config = PerceptionConfig(background_frames=1, camera_position=(0.05, 0.38, 1.4))
    with pytest.raises(ValueError, match='is the camera pose right'):
        BackgroundLearner(config, renderer.intrinsics).add(renderer.frame())


def test_a_table_that_appears_later_is_learned(renderer) -> None:
    learner = BackgroundLearner(renderer.config, renderer.intrinsics)
    wall = np.full(renderer.intrinsics.shape, 0.5, np.float32)
    frames = [replace(renderer.frame(), depth=wall) for _ in range(5)]
    assert [learner.add(frame) for frame in frames[:4]] == [None] * 4
    with pytest.raises(NoTableError, match='Expected the table at z = 0'):
        learner.add(frames[4])
    learned = [learner.add(renderer.frame()) for _ in range(5)]
    assert learned[4] is not None


def test_an_image_without_depth_is_refused(renderer, catalogue) -> None:
    perception = TabletopPerception(renderer.config, renderer.intrinsics, catalogue)
    rgb = np.zeros((240, 320, 3), np.uint8)
    with pytest.raises(ValueError, match='Expected depth readings, got 0'):
        perception.process(RgbdFrame(1, '', rgb, np.full((240, 320), np.nan, np.float32)))
    with pytest.raises(ValueError, match='Expected an image of 240x320, got 8x8'):
        perception.process(RgbdFrame(1, '', rgb[:8, :8], np.ones((8, 8), np.float32)))

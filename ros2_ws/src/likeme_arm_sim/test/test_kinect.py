from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from likeme_arm_sim.kinect import Kinect, in_projector_shadow, quantised
from likeme_arm_sim.kinect_noise import KinectNoise
from likeme_arm_sim.renderer import Rendering
from likeme_core.paper_world import WORLD

CAMERA = WORLD.camera
SHAPE = CAMERA.height, CAMERA.width


def flat(depth: float) -> Rendering:
    """A wall of one grey at one depth, m."""
    return Rendering(np.full((*SHAPE, 3), 128, np.uint8), np.full(SHAPE, depth, np.float32))


def block(front: float, back: float) -> NDArray[np.float32]:
    """Columns 300 to 339 at `front`, the rest at `back`, m."""
    depth = np.full(SHAPE, back, np.float32)
    depth[:, 300:340] = front
    return depth


def readings(depth: float, frames: int = 8) -> NDArray[np.float64]:
    kinect = Kinect(CAMERA, replace(KinectNoise(), disparity_step=1e-4), seed=3)
    images = np.stack([kinect.sense(flat(depth)).depth_mm for _ in range(frames)])
    return images[images > 0] / 1000.0


@pytest.mark.parametrize('depth', [0.6, 1.0, 2.0, 3.0])
def test_axial_noise_is_that_of_nguyen_izadi_and_lovell(depth: float) -> None:
    found = readings(depth)
    assert found.mean() == pytest.approx(depth, abs=0.0005)
    assert found.std() == pytest.approx(0.0012 + 0.0019 * (depth - 0.4) ** 2, rel=0.05)


def test_one_pixel_varies_over_time_as_its_neighbours_vary_in_one_frame() -> None:
    kinect = Kinect(CAMERA, seed=5)
    images = np.stack([kinect.sense(flat(1.0)).depth_mm for _ in range(60)])[:, ::8, ::8]
    valid = np.where(images > 0, images, np.nan).astype(float)
    assert np.nanstd(valid, axis=0).mean() == pytest.approx(np.nanstd(valid[0]), rel=0.1)


@pytest.mark.parametrize(('depth', 'step'), [(1.0, 0.00284), (2.0, 0.0114), (3.0, 0.0256)])
def test_depth_comes_in_the_steps_of_khoshelham_and_elberink(depth: float, step: float) -> None:
    ramp = np.linspace(depth - 1.5 * step, depth + 1.5 * step, 3000, dtype=np.float32)[None]
    levels = np.unique(quantised(ramp, KinectNoise()))
    assert np.diff(levels) == pytest.approx(step, rel=0.03)
    assert np.abs(quantised(ramp, KinectNoise()) - ramp).max() < 0.52 * step


def test_the_projector_leaves_a_shadow_on_the_left_as_wide_as_triangulation_says() -> None:
    shift = CAMERA.fx * 0.075
    dark = in_projector_shadow(block(0.8, 1.2), shift)
    assert dark[100, 300:].sum() == 0
    assert dark[100, :300].sum() == pytest.approx(shift * (1 / 0.8 - 1 / 1.2), abs=1)
    assert dark[100, 299]
    assert not in_projector_shadow(flat(1.0).depth, shift).any()


def test_the_running_minimum_is_that_of_a_plain_loop() -> None:
    rng = np.random.default_rng(0)
    depth = np.repeat(rng.uniform(0.5, 3.0, (4, 64)), 10, axis=1).astype(np.float32)
    column = np.arange(640) - 39.375 / depth.astype(float)
    first = np.minimum.accumulate(column[:, ::-1], axis=1)[:, ::-1]
    clear = np.abs(column - first) > 1e-3
    dark = in_projector_shadow(depth, 39.375)
    assert np.array_equal(dark[clear], (column > first)[clear])
    assert not dark[column == first].any()


def test_no_reading_out_of_range_or_where_nothing_is() -> None:
    kinect = Kinect(CAMERA)
    for depth in (0.3, 4.5, np.inf):
        assert kinect.sense(flat(depth)).depth_mm.max() == 0
    assert (kinect.sense(flat(0.5)).depth_mm > 0).mean() > 0.99


def test_readings_get_lost_at_edges_and_at_grazing_incidence() -> None:
    noise = replace(KinectNoise(), speckle_loss=0.0, grazing_loss=1.0)
    image = Kinect(CAMERA, noise).sense(flat(1.0)._replace(depth=block(0.9, 1.0)))
    assert image.depth_mm[:, 340].max() == 0
    assert (image.depth_mm[:, 345:] > 0).all()
    # Falling away by 6 mm a pixel at 1 m is an incidence of 72 degrees, 25 mm one of 86.
    lost = []
    for slope in (0.0, 0.002, 0.006, 0.025):
        ramp = np.broadcast_to(1.0 + slope * (np.arange(SHAPE[1]) % 20), SHAPE).astype(np.float32)
        inner = Kinect(CAMERA, noise).sense(flat(1.0)._replace(depth=ramp)).depth_mm[:, 30:39]
        lost.append((inner == 0).mean())
    assert lost[0] == lost[1] == 0
    assert 0 < lost[2] < 0.5 < lost[3]


def test_the_same_seed_gives_the_same_images_and_another_does_not() -> None:
    one, same, other = (Kinect(CAMERA, seed=seed) for seed in (7, 7, 8))
    for _ in range(2):
        a, b, c = (kinect.sense(flat(1.0)) for kinect in (one, same, other))
        assert np.array_equal(a.depth_mm, b.depth_mm)
        assert np.array_equal(a.rgb, b.rgb)
        assert not np.array_equal(a.depth_mm, c.depth_mm)
    assert not np.array_equal(a.depth_mm, one.sense(flat(1.0)).depth_mm)


def test_a_frame_does_not_depend_on_the_one_before() -> None:
    used = Kinect(CAMERA, seed=7)
    depth = block(0.9, 1.2)
    depth[200:] = 1.0
    depth[310:320, 100:140] = 0.8
    for before in (flat(1.0), flat(1.0)._replace(depth=block(0.9, 1.2))):
        used.sense(before)
        fresh = Kinect(CAMERA, seed=7)
        for kinect in (used, fresh):
            kinect.restart(1)
        seen = [kinect.sense(flat(1.0)._replace(depth=depth)) for kinect in (used, fresh)]
        assert np.array_equal(seen[0].depth_mm, seen[1].depth_mm)


def test_patterns_take_turns_and_are_noise_like_any_other() -> None:
    kinect = Kinect(CAMERA, replace(KinectNoise(), patterns=2, disparity_step=1e-4), seed=3)
    images = [kinect.sense(flat(1.0)) for _ in range(5)]
    for earlier, later in ((0, 2), (1, 3), (2, 4)):
        np.testing.assert_array_equal(images[earlier].depth_mm, images[later].depth_mm)
        np.testing.assert_array_equal(images[earlier].rgb, images[later].rgb)
    assert (images[0].depth_mm != images[1].depth_mm).mean() > 0.5
    valid = images[0].depth_mm[images[0].depth_mm > 0] / 1000.0
    assert valid.std() == pytest.approx(0.0012 + 0.0019 * 0.6**2, rel=0.05)


def test_colour_is_noisy_by_the_stated_amount_and_the_rendering_is_left_alone() -> None:
    frame = flat(1.0)
    image = Kinect(CAMERA).sense(frame)
    assert image.rgb.dtype == np.uint8
    assert image.rgb.std() == pytest.approx(2.0, rel=0.1)
    assert image.rgb.mean() == pytest.approx(128, abs=0.2)
    assert (frame.rgb == 128).all()
    assert (frame.depth == 1.0).all()


def test_a_depth_of_another_size_is_refused() -> None:
    small = Rendering(np.zeros((240, 320, 3), np.uint8), np.ones((240, 320), np.float32))
    with pytest.raises(ValueError, match='Expected a depth of 480x640, got 240x320'):
        Kinect(CAMERA).sense(small)

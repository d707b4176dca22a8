"""Blobs, and the colour model that separates a hand from objects."""

from __future__ import annotations

import cv2
import numpy as np
from scipy import ndimage

from likeme_perception.blobs import blobs_of, image_components, merged, rows_and_columns
from likeme_perception.catalogue import Catalogue
from likeme_perception.colour import colour_bins
from likeme_perception.hand_arm_colour import HandArmColour

SKIN, YELLOW = (222, 170, 140), (235, 205, 30)


def test_components_equal_those_of_scipy_largest_first() -> None:
    rng = np.random.default_rng(3)
    noise = cv2.GaussianBlur(rng.normal(size=(120, 160)).astype(np.float32), (0, 0), 2)
    mask = (noise > 0.1).astype(np.uint8)
    labels, count = ndimage.label(mask, np.ones((3, 3)))
    expected = [np.flatnonzero(labels == k + 1) for k in range(count)]
    found = image_components(mask, least_pixels=12)
    assert [len(region) for region in found] == sorted(
        (len(region) for region in expected if len(region) >= 12), reverse=True
    )
    assert len(found) > 5
    assert {r.tobytes() for r in found} == {r.tobytes() for r in expected if len(r) >= 12}


def test_an_empty_mask_has_no_components() -> None:
    assert image_components(np.zeros((20, 30), np.uint8)) == []
    assert len(merged([]).pixels) == 0


def test_rows_and_columns_are_those_of_divmod() -> None:
    pixels = np.arange(0, 307_200, 7)
    for found, expected in zip(rows_and_columns(pixels, 640), np.divmod(pixels, 640), strict=True):
        np.testing.assert_array_equal(found, expected)


def test_several_blobs_equal_those_computed_one_by_one(renderer, lemon, pear) -> None:
    frame = renderer.frame(lemon(0.4, 0.1), pear(0.5, -0.2))
    regions = [np.arange(900, 1900), np.arange(40_000, 40_013), np.arange(30_000, 33_000, 5)]
    together = blobs_of(regions, frame, renderer.view)
    for region, blob in zip(regions, together, strict=True):
        (alone,) = blobs_of([region], frame, renderer.view)
        assert blob.area == alone.area
        for name in ('pixels', 'points', 'bins', 'xyz'):
            np.testing.assert_array_equal(getattr(blob, name), getattr(alone, name))
        np.testing.assert_array_equal(blob.pixels, region)
        np.testing.assert_array_equal(blob.bins, colour_bins(frame.rgb, region))
        np.testing.assert_array_equal(blob.xyz.T, blob.points)


def test_an_object_in_a_hand_is_separated_by_its_colour(catalogue: Catalogue) -> None:
    rgb = np.full((40, 60, 3), SKIN, np.uint8)
    rgb[10:30, 20:40] = YELLOW
    pixels = np.arange(rgb.shape[0] * rgb.shape[1])
    bins = colour_bins(rgb, pixels)
    hand = HandArmColour(catalogue.best_log_density)
    hand.learn(bins)
    thing = hand.object_pixels(pixels, bins, rgb.shape[1]).reshape(40, 60)
    assert thing[13:27, 23:37].all()
    assert not thing[:7].any()
    assert not thing[:, :17].any()
    assert not HandArmColour(None).object_pixels(pixels, bins, rgb.shape[1]).any()


def test_a_separate_finger_is_part_of_the_hand_and_a_lemon_is_not(catalogue: Catalogue) -> None:
    finger, lemon = (
        colour_bins(np.full((1, 400, 3), colour, np.uint8), np.arange(400))
        for colour in (SKIN, YELLOW)
    )
    hand = HandArmColour(catalogue.best_log_density)
    assert not hand.explains(finger)
    hand.learn(finger)
    assert hand.explains(finger)
    hand.learn(lemon)
    assert not hand.explains(lemon)

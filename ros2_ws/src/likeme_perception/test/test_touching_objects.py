"""Two objects that touch, told apart by their colours."""

from __future__ import annotations

import numpy as np

from likeme_core.world import load_world
from likeme_perception.blobs import Blob, Index
from likeme_perception.catalogue import CatalogueObject, world_catalogue
from likeme_perception.colour import bins_of_lab
from likeme_perception.touching_objects import split_by_colour

CATALOGUE = world_catalogue(load_world('three_bins'))
WIDTH = 100


def patch(known: CatalogueObject, column: int) -> tuple[Index, np.ndarray]:
    """Pixels of 20 rows and 20 columns, and their colour bins."""
    rows, columns = np.mgrid[10:30, column : column + 20]
    lab = np.tile(np.array(known.colour[0].mean) * (2.55, 1, 1) + (0, 128, 128), (400, 1))
    return (rows * WIDTH + columns).ravel(), bins_of_lab(lab.astype(np.uint8))


def touching(area: float) -> tuple[Blob, list[Index]]:
    """A banana and a plum side by side as one blob of an area, m^2; the pixels of each."""
    known = {each.name: each for each in CATALOGUE.objects}
    parts = [patch(known['banana'], 10), patch(known['plum'], 30)]
    pixels = np.concatenate([pixels for pixels, _ in parts])
    order = np.argsort(pixels)
    bins = np.concatenate([bins for _, bins in parts])[order]
    points = np.zeros((len(pixels), 3), np.float32)
    return Blob(pixels[order], points, bins, area), [np.sort(pixels) for pixels, _ in parts]


def test_two_that_touch_stay_two_though_their_area_varies_with_noise() -> None:
    banana = next(each for each in CATALOGUE.objects if each.name == 'banana')
    large, each = touching(1.3 * banana.area)
    small, _ = touching(1.2 * banana.area)

    assert len(split_by_colour(large, WIDTH, CATALOGUE)) == 2
    assert len(split_by_colour(small, WIDTH, CATALOGUE)) == 1
    assert len(split_by_colour(small, WIDTH, CATALOGUE, each)) == 2


def test_one_object_with_another_beside_it_before_stays_one() -> None:
    banana = next(each for each in CATALOGUE.objects if each.name == 'banana')
    pixels, bins = patch(banana, 10)
    alone = Blob(pixels, np.zeros((400, 3), np.float32), bins, banana.area)
    gone = touching(banana.area)[1]

    assert split_by_colour(alone, WIDTH, CATALOGUE, gone) == [alone]

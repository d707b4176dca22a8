"""Identification by colour and size, and the catalogue."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import cv2
import numpy as np
import pytest

from likeme_core.paper_world import WORLD
from likeme_perception.catalogue import Catalogue, world_catalogue
from likeme_perception.colour import (
    BINS,
    ColourHistogram,
    bins_of_lab,
    colour_bins,
    mixture_log_density,
    mixture_of,
)
from likeme_perception.identification import assign, identity_probability, one_of_each
from likeme_perception.top_view import Shape


def test_the_toys_of_the_cell_are_in_the_catalogue() -> None:
    assert {o.name for o in world_catalogue(WORLD).objects} == {'pear', 'lemon', 'chicken'}


@pytest.mark.parametrize('name', ['pear', 'lemon', 'chicken'])
def test_pixels_sampled_from_an_objects_model_are_identified(name: str) -> None:
    known = world_catalogue(WORLD)
    k = [o.name for o in known.objects].index(name)
    rng = np.random.default_rng(0)
    part = known.objects[k].colour[0]
    lab = rng.normal(part.mean, part.deviation, (300, 3)) * (2.55, 1, 1) + (0, 128, 128)
    probability = identity_probability(known, bins_of_lab(np.clip(lab, 0, 255).astype(np.uint8)))
    assert probability.sum() == pytest.approx(1.0)
    assert probability[k] > 0.9


def test_a_colour_in_no_catalogue_is_unknown() -> None:
    magenta = np.full((1, 200, 3), (200, 0, 200), np.uint8)
    bins = colour_bins(magenta, np.arange(200))
    assert identity_probability(world_catalogue(WORLD), bins)[-1] > 0.9


def test_objects_of_equal_colour_are_identified_by_size() -> None:
    lemon = next(o for o in world_catalogue(WORLD).objects if o.name == 'lemon')
    both = Catalogue((lemon, replace(lemon, name='melon', length=0.16, width=0.14)))
    lab = np.tile(np.array(lemon.colour[0].mean) * (2.55, 1, 1) + (0, 128, 128), (100, 1))
    bins = bins_of_lab(lab.astype(np.uint8))
    small = Shape((0.4, 0.1, 0.02), 0.0, lemon.length, lemon.width, lemon.height)
    assert identity_probability(both, bins, small)[0] > 0.95
    assert identity_probability(both, bins)[0] == pytest.approx(0.5, abs=0.01)


def test_the_assignment_is_globally_optimal_and_gated() -> None:
    table = np.array([[0.6, 0.35, 0.05], [0.55, 0.05, 0.4], [0.1, 0.1, 0.8]])
    matches = assign(table, least=0.3)
    assert {k: m.blob for k, m in matches.items()} == {0: 1, 1: 0}
    assert matches[1].probability == pytest.approx(0.35)
    assert assign(np.zeros((0, 3)), 0.3) == {}


def test_a_fitted_mixture_is_denser_at_its_own_colours() -> None:
    rng = np.random.default_rng(1)
    lab = np.concatenate(
        [rng.normal((60, 20, 40), 2, (300, 3)), rng.normal((40, -30, 10), 2, (300, 3))]
    )
    density = mixture_log_density(mixture_of(lab))
    assert density.shape == (BINS,)
    own = bins_of_lab((lab * (2.55, 1, 1) + (0, 128, 128)).astype(np.uint8))
    other = bins_of_lab(np.full((5, 3), (200, 128, 60), np.uint8))
    assert density[own].mean() > density[other].mean() + 3
    with pytest.raises(ValueError, match='at least 20 pixels to learn a colour, got 5'):
        mixture_of(lab[:5])


def test_a_colour_histogram_learns_and_forgets() -> None:
    colour = ColourHistogram(keep=0.5)
    assert not colour.known
    skin = colour_bins(np.full((1, 400, 3), (222, 170, 140), np.uint8), np.arange(400))
    glove = colour_bins(np.full((1, 400, 3), (180, 20, 40), np.uint8), np.arange(400))
    for _ in range(3):
        colour.update(skin)
    assert colour.known
    assert colour.log_density[skin[0]] > colour.log_density[glove[0]] + 3
    for _ in range(12):
        colour.update(glove)
    assert colour.log_density[glove[0]] > colour.log_density[skin[0]] + 2


def test_a_catalogue_with_a_name_twice_is_refused() -> None:
    lemon = world_catalogue(WORLD).objects[0]
    with pytest.raises(ValueError, match='Expected 2 different names, got 1'):
        Catalogue((lemon, lemon))


def test_colour_bins_use_the_8_bit_lab_of_opencv() -> None:
    rgb = np.array([[[154, 186, 52]]], np.uint8)
    lab = cv2.cvtColor(rgb, cv2.COLOR_RGB2LAB)[0]
    assert bins_of_lab(lab)[0] == colour_bins(rgb, np.array([0]))[0]


@pytest.mark.parametrize('blobs', [1, 2, 4])
def test_one_of_each_is_the_marginal_over_all_assignments(blobs: int) -> None:
    single = np.random.default_rng(blobs).dirichlet(np.ones(4), blobs)
    marginal = np.zeros_like(single)
    for chosen in product(range(4), repeat=blobs):
        named = [k for k in chosen if k < 3]
        if len(set(named)) == len(named):
            marginal[range(blobs), chosen] += np.prod(single[range(blobs), chosen])
    marginal /= marginal.sum(axis=1, keepdims=True)
    assert one_of_each(single) == pytest.approx(marginal)


def test_what_is_surely_one_object_is_not_the_other() -> None:
    joint = one_of_each(np.array([[0.98, 0.01, 0.01], [0.6, 0.39, 0.01]]))
    assert joint[1].argmax() == 1
    assert joint[1, 1] > 0.9


def test_of_many_objects_the_likely_ones_are_one_blob_each() -> None:
    single = np.full((2, 31), 0.01 / 28)
    single[0, [4, 17]], single[1, [4, 17]] = (0.97, 0.01), (0.69, 0.29)
    single /= single.sum(axis=1, keepdims=True)
    joint = one_of_each(single)
    assert joint.sum(axis=1) == pytest.approx(1.0)
    assert joint.argmax(axis=1).tolist() == [4, 17]

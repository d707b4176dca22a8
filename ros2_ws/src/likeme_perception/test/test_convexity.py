"""Objects of one colour that touch or are stacked are told apart by the shape of their surface."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from likeme_perception import convex_splitter
from likeme_perception.catalogue import Catalogue
from likeme_perception.convexity import convex_parts

CAMERA = np.array([0.0, 0.0, 1.0])


def settle(perception, renderer, *things, frames: int = 8):
    """Process the same scene for some frames; the last observation."""
    for _ in range(frames):
        seen = perception.process(renderer.frame(*things))
    return seen


def upper_ball(x: float, y: float, z: float, radius: float) -> np.ndarray:
    """Points of the half of a ball that is seen from above, (N, 3)."""
    side = np.arange(-radius, radius, 0.002)
    u, v = (axis.ravel() for axis in np.meshgrid(side, side))
    inside = np.hypot(u, v) < 0.97 * radius
    u, v = u[inside], v[inside]
    noise = np.random.default_rng(2).normal(0, 0.0007, len(u))
    return np.stack([x + u, y + v, z + np.sqrt(radius**2 - u**2 - v**2) + noise], axis=1)


def vessel(radius: float) -> np.ndarray:
    """Points of a hemispherical vessel: a side of its outside, and most of its inside."""
    round_, up = (
        a.ravel() for a in np.meshgrid(np.arange(0, 2 * np.pi, 0.05), np.arange(30) / 20)
    )
    shell = np.stack([np.cos(round_) * np.cos(up), np.sin(round_) * np.cos(up), -np.sin(up)], 1)
    outside = shell[(shell[:, 0] < -0.2) & (shell[:, 2] > -0.8)] * (radius + 0.004)
    inside = shell[shell[:, 0] > -0.1] * radius
    return np.concatenate([outside, inside]) + np.array([0, 0, radius])


@pytest.mark.parametrize(
    ('points', 'count'),
    [
        (upper_ball(0, 0, 0.03, 0.04), 1),
        (np.concatenate([upper_ball(x, 0, 0.03, 0.03) for x in (-0.028, 0.028)]), 2),
        (np.concatenate([upper_ball(0, 0, 0.06, 0.06), upper_ball(0.05, 0, 0.13, 0.03)]), 2),
    ],
    ids=['one', 'side by side', 'one on another'],
)
def test_a_surface_is_split_where_it_is_concave(points: np.ndarray, count: int) -> None:
    part = convex_parts(points, CAMERA, 0.1)
    assert part.shape == (len(points),)
    assert set(part) == set(range(count))
    if count == 2:
        halves = [points[part == k][:, 0].mean() for k in range(2)]
        assert abs(halves[0] - halves[1]) > 0.03


def test_the_inside_of_a_vessel_is_no_object_of_its_own() -> None:
    points = vessel(0.06)
    assert set(convex_parts(points, np.array([-0.8, 0.0, 0.8]), 0.05)) == {0}


@pytest.mark.parametrize('away', [(0.0, 0.058), (0.041, 0.041), (0.058, 0.0)])
def test_two_touching_objects_of_one_colour_are_two(renderer, catalogue, lemon, away) -> None:
    perception = renderer.perception(catalogue)
    x, y = 0.42, 0.0
    seen = settle(perception, renderer, lemon(x, y), lemon(x + away[0], y + away[1]))
    assert sorted(each.name for each in seen.unknown_objects) == ['lemon_1', 'lemon_2']
    for each in seen.unknown_objects:
        off = np.array(each.shape.centroid[:2]) - [(x, y), (x + away[0], y + away[1])]
        assert np.hypot(*off.T).min() < 0.008


def test_a_surface_is_split_once_while_nothing_changes(
    renderer, lemon, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls = []

    def counted(*given: object) -> np.ndarray:
        calls.append(given)
        return convex_parts(*given)

    monkeypatch.setattr(convex_splitter, 'convex_parts', counted)
    perception = renderer.perception(Catalogue(()))
    pair = lemon(0.42, 0.0), lemon(0.42, 0.058)
    assert len(settle(perception, renderer, *pair).unknown_objects) == 2
    assert len(calls) == 1
    moved = [replace(ball, centre=(0.5, *ball.centre[1:])) for ball in pair]
    assert len(settle(perception, renderer, *moved).unknown_objects) == 2
    assert len(calls) == 2
    # Something on top of one of them, within its outline.
    top = replace(pair[0], centre=(0.5, 0.0, 0.07), radius=0.02)
    settle(perception, renderer, *moved, top)
    assert len(calls) == 3


def test_a_known_object_is_never_split(
    renderer, catalogue, lemon, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(convex_splitter, 'convex_parts', pytest.fail)
    seen = settle(renderer.perception(catalogue), renderer, lemon(0.42, 0.1))
    assert seen.object('lemon').settled

"""Toys under gravity."""

from __future__ import annotations

import numpy as np
import pytest

from likeme_arm_sim.layout import draw_layout
from likeme_arm_sim.physics_world import PhysicsWorld
from likeme_arm_sim.toys import toys_of
from likeme_core.paper_world import OFFTABLE, WORLD
from likeme_core.tabletop import State

TOYS = toys_of(WORLD)


def fallen(name: str, seconds: float) -> PhysicsWorld:
    """A world in which a toy was let go beside the table."""
    world = PhysicsWorld(WORLD.table, TOYS)
    world.put_toy(name, 0.42, 0.46, 0.05, 0.3)
    for _ in range(round(seconds * 240)):
        world.step()
    return world


@pytest.mark.parametrize('name', WORLD.objects)
def test_a_fallen_toy_comes_to_rest_on_the_floor(name: str) -> None:
    world = fallen(name, 8.0)
    x, y, z = world.toy_pose(name).position
    assert WORLD.regions.state_of(x, y, z) == OFFTABLE
    assert WORLD.table.floor_z < z < WORLD.table.floor_z + 0.05
    assert world.toy_speed(name) < 0.05
    assert np.hypot(x - 0.42, y - 0.46) < 1.0


def test_the_same_start_has_the_same_end() -> None:
    first, second = (fallen('lemon', 2.0).toy_pose('lemon') for _ in range(2))
    assert np.array_equal(first.position, second.position)
    assert np.array_equal(first.orientation, second.orientation)


@pytest.mark.parametrize('name', WORLD.objects)
def test_a_toy_lies_where_it_was_put(name: str) -> None:
    world = PhysicsWorld(WORLD.table, TOYS)
    world.put_toy(name, 0.44, 0.1, 0.0, 1.0)
    for _ in range(240):
        world.step()
    assert np.allclose(world.toy_pose(name).position[:2], [0.44, 0.1], atol=0.02)
    assert world.toy_speed(name) < 0.01


@pytest.mark.parametrize('state', list(WORLD.states))
def test_layouts_are_in_their_state_and_apart(state: State) -> None:
    scene = WORLD
    wanted = dict.fromkeys(WORLD.objects, state)
    layout = draw_layout(scene, wanted, [], np.random.default_rng(3))
    points = np.array([[place.x, place.y] for place in layout.values()])
    assert all(WORLD.region(state).start.contains(x, y) for x, y in points)
    assert all(scene.regions.state_of(p.x, p.y, p.ground) == state for p in layout.values())
    gaps = np.linalg.norm(points[:, None] - points[None], axis=2)[np.triu_indices(3, 1)]
    assert gaps.min() > 0.1
    assert layout == draw_layout(scene, wanted, [], np.random.default_rng(3))


def test_the_floor_area_is_in_the_cameras_view() -> None:
    scene = WORLD
    area, into = WORLD.region(OFFTABLE).start, np.linalg.inv(scene.camera.pose())
    for x in (area.x_min, area.x_max):
        for y in (area.y_min, area.y_max):
            point = into[:3, :3] @ [x, y, scene.table.floor_z + 0.03] + into[:3, 3]
            u = scene.camera.fx * point[0] / point[2] + scene.camera.cx
            v = scene.camera.fy * point[1] / point[2] + scene.camera.cy
            assert 20 < u < scene.camera.width - 20
            assert 20 < v < scene.camera.height - 20

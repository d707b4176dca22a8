from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pybullet as bullet
import pytest
from numpy.typing import NDArray

from likeme_arm_sim.toys import Toy, spawn, toys_of
from likeme_core.paper_world import WORLD

TOYS = toys_of(WORLD)


GRIPPER_OPENING = 0.08


@pytest.fixture
def table() -> Iterator[int]:
    client = bullet.connect(bullet.DIRECT)
    bullet.setGravity(0, 0, -9.81, physicsClientId=client)
    slab = bullet.createCollisionShape(
        bullet.GEOM_BOX, halfExtents=(1, 1, 0.1), physicsClientId=client
    )
    top = bullet.createMultiBody(0, slab, basePosition=(0, 0, -0.1), physicsClientId=client)
    bullet.changeDynamics(top, -1, lateralFriction=0.6, physicsClientId=client)
    yield client
    bullet.disconnect(client)


def wait(client: int, seconds: float) -> None:
    for _ in range(round(240 * seconds)):
        bullet.stepSimulation(physicsClientId=client)


def pose(client: int, body: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    position, turn = bullet.getBasePositionAndOrientation(body, physicsClientId=client)
    return np.array(position), np.array(bullet.getMatrixFromQuaternion(turn)).reshape(3, 3)


def settled(client: int, toy: Toy) -> int:
    body = spawn(toy, client, (0.0, 0.0, toy.resting_height + 0.003))
    wait(client, 3.0)
    return body


def pushed(client: int, body: int) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
    """Way (3,), directions of the velocity on it (N, 3), and angle turned, rad, after a nudge."""
    start, turned, directions = pose(client, body)[0], 0.0, []
    bullet.resetBaseVelocity(body, (0, 0.25, 0), (0, 0, 0), physicsClientId=client)
    for _ in range(960):
        bullet.stepSimulation(physicsClientId=client)
        linear, angular = bullet.getBaseVelocity(body, physicsClientId=client)
        turned += float(np.linalg.norm(angular)) / 240
        if np.linalg.norm(linear) > 0.03:
            directions.append(np.array(linear) / np.linalg.norm(linear))
    return pose(client, body)[0] - start, np.array(directions), turned


@pytest.mark.parametrize('toy', TOYS.values(), ids=TOYS.keys())
def test_a_toy_has_the_size_of_its_kind_and_fits_the_gripper(toy: Toy) -> None:
    length = {'pear': 0.085, 'lemon': 0.070, 'chicken': 0.090}[toy.name]
    assert toy.size[0] == pytest.approx(length, abs=0.003)
    assert toy.size[1] < GRIPPER_OPENING - 0.01
    assert toy.size[0] > toy.size[1]
    cloud = np.concatenate([part.vertices for part in toy.parts])
    assert np.ptp(cloud, axis=0) == pytest.approx(toy.size)
    assert cloud.min(axis=0).max() < 0 < cloud.max(axis=0).min()


@pytest.mark.parametrize('toy', TOYS.values(), ids=TOYS.keys())
def test_a_toy_comes_to_rest_where_the_camera_sees_it_touch(table: int, toy: Toy) -> None:
    body = settled(table, toy)
    before, turn = pose(table, body)
    lowest = min((part.vertices @ turn.T)[:, 2].min() for part in toy.parts) + before[2]
    assert abs(lowest) < 0.0008
    wait(table, 2.0)
    assert np.abs(pose(table, body)[0] - before).max() < 1e-4


def hard(name: str) -> Toy:
    """A toy of hard matter, whose shape alone says how it rolls."""
    toy = TOYS[name]
    return toy.with_physics(replace(toy.physics, friction=0.45, rolling_friction=0.0003))


def test_a_nudged_lemon_rolls(table: int) -> None:
    way, _, turned = pushed(table, settled(table, hard('lemon')))
    assert way[1] > 0.08
    assert turned > 2.0


def test_a_nudged_chicken_slides_and_stays_upright(table: int) -> None:
    body = settled(table, TOYS['chicken'])
    way, _, turned = pushed(table, body)
    assert 0.002 < way[1] < 0.03
    assert turned < 0.2
    assert pose(table, body)[1][2, 2] > 0.99


def test_a_nudged_pear_rolls_in_a_curve(table: int) -> None:
    way, directions, turned = pushed(table, settled(table, hard('pear')))
    assert np.linalg.norm(way) > 0.05
    assert turned > 1.0
    bend = np.arccos(np.clip(directions[0] @ directions[-1], -1, 1))
    assert bend > np.radians(25)


def test_a_chicken_tipped_a_little_falls_back_on_its_base(table: int) -> None:
    toy = TOYS['chicken']
    tipped = bullet.getQuaternionFromEuler((np.radians(20), 0, 0))
    body = spawn(toy, table, (0.0, 0.0, 0.04))
    bullet.resetBasePositionAndOrientation(body, (0, 0, 0.04), tipped, physicsClientId=table)
    wait(table, 2.0)
    assert pose(table, body)[1][2, 2] > 0.99

"""The simulated person."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest

from likeme_arm_sim.hand_shapes import Posture, Side, hand_parts
from likeme_arm_sim.human_hand import AWAY, HumanHand, minimum_jerk
from likeme_arm_sim.physics_world import PhysicsWorld
from likeme_arm_sim.simulated_person import PersonSettings, SimulatedPerson
from likeme_arm_sim.toys import toys_of
from likeme_core.outcomes import MotionOutcome
from likeme_core.paper_world import LEFT, OFFTABLE, PUSH_LEFT, RIGHT, WORLD
from likeme_core.tabletop import Action, State

TOYS = toys_of(WORLD)

STARTS = {LEFT: (0.43, 0.12, 0.0), RIGHT: (0.43, -0.12, 0.0)}
STARTS[OFFTABLE] = (0.42, -0.65, WORLD.table.floor_z)


class Shown(NamedTuple):
    """What became of one demonstration."""

    outcome: MotionOutcome
    state: State
    rise: float
    seconds: float
    away: bool


def show(name: str, start: State, action: Action, seed: int = 0) -> Shown:
    world = PhysicsWorld(WORLD.table, {name: TOYS[name]})
    heights: list[float] = []

    def tick() -> None:
        world.step()
        heights.append(float(world.toy_pose(name).position[2]))

    hand = HumanHand(world, tick)
    rng = np.random.default_rng(seed)
    world.put_toy(name, *STARTS[start], float(rng.uniform(-1.5, 1.5)))
    hand.wait(0.3)
    began, rest = world.time, heights[-1]
    ending = SimulatedPerson(world, hand, WORLD, PersonSettings()).perform(name, action, rng)
    seconds, rise = world.time - began, max(heights) - rest
    hand.wait(1.0)
    state = WORLD.regions.state_of(*map(float, world.toy_pose(name).position))
    return Shown(ending.outcome, state, rise, seconds, hand.away)


@pytest.mark.parametrize('name', TOYS)
@pytest.mark.parametrize('start', list(WORLD.states))
@pytest.mark.parametrize('target', list(WORLD.states))
def test_placing_lifts_visibly_and_arrives(name: str, start: State, target: State) -> None:
    shown = show(name, start, WORLD.action(target))
    assert shown.outcome is MotionOutcome.COMPLETED
    assert shown.state is target
    assert shown.rise > 0.08
    assert 3.0 < shown.seconds < 8.0
    assert shown.away


@pytest.mark.parametrize('name', TOYS)
@pytest.mark.parametrize('start', [LEFT, RIGHT])
@pytest.mark.parametrize('target', list(WORLD.states))
def test_pushing_stays_low_and_arrives(name: str, start: State, target: State) -> None:
    shown = show(name, start, WORLD.action(target + 3))
    assert shown.state is target
    assert shown.rise < 0.02
    assert 3.0 < shown.seconds < 7.0
    assert shown.away


def test_what_lies_on_the_floor_cannot_be_pushed() -> None:
    shown = show('pear', OFFTABLE, PUSH_LEFT)
    assert shown.outcome is MotionOutcome.OBJECT_OFFTABLE
    assert shown.seconds == 0.0


@pytest.mark.parametrize('side', list(Side))
@pytest.mark.parametrize('posture', list(Posture))
def test_the_resting_hand_is_out_of_the_cameras_view(posture: Posture, side: Side) -> None:
    camera = WORLD.camera
    into = np.linalg.inv(camera.pose())
    for mesh in hand_parts(posture, side=side).values():
        x, y, z = into[:3, :3] @ (mesh.vertices + AWAY).T + into[:3, 3:]
        u, v = camera.fx * x / z + camera.cx, camera.fy * y / z + camera.cy
        inside = (u > 0) & (u < camera.width) & (v > 0) & (v < camera.height) & (z > 0)
        assert not inside.any()


def test_minimum_jerk_starts_and_ends_softly() -> None:
    share = minimum_jerk(100)
    assert share[-1] == pytest.approx(1.0)
    assert share[0] < 1e-4
    assert np.all(np.diff(share) >= 0)

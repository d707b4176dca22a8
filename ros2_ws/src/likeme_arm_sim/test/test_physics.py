"""Physical parameters reach the physics engine."""

from __future__ import annotations

from dataclasses import replace

import pytest

from likeme_arm_sim.cell import Cell, CellSettings
from likeme_arm_sim.physics import GripperPhysics, HandPhysics, Physics
from likeme_arm_sim.toys import toys_of
from likeme_core.paper_world import WORLD

TOYS = toys_of(WORLD)

HEAVY = replace(TOYS['lemon'].physics, mass=0.2, friction=0.3, rolling_friction=0.001)
OTHER = Physics(
    ground_friction=0.9,
    toys={'lemon': HEAVY},
    gripper=GripperPhysics(friction=0.2),
    hand=HandPhysics(mass=2.0),
)


@pytest.fixture(scope='module')
def cell() -> Cell:
    return Cell(WORLD, 1, CellSettings(physics=OTHER))


def dynamics(cell: Cell, body: int, link: int = -1) -> tuple[float, ...]:
    """Mass, friction, inertia, ... as bullet has them."""
    return tuple(cell.physics_world.client.getDynamicsInfo(body, link))


def test_every_object_has_its_numbers() -> None:
    assert set(TOYS) == set(WORLD.objects)


def test_numbers_of_a_cells_own_are_used(cell: Cell) -> None:
    mass, friction, inertia = dynamics(cell, cell.physics_world.toys['lemon'])[:3]
    assert (mass, friction) == (HEAVY.mass, HEAVY.friction)
    assert inertia == pytest.approx(TOYS['lemon'].with_physics(HEAVY).inertia)
    assert dynamics(cell, cell.physics_world.table)[1] == OTHER.ground_friction
    assert dynamics(cell, cell.arm.body, 9)[1] == OTHER.gripper.friction


def test_what_is_not_named_keeps_its_own(cell: Cell) -> None:
    pear = dynamics(cell, cell.physics_world.toys['pear'])
    assert pear[:2] == (TOYS['pear'].physics.mass, TOYS['pear'].physics.friction)


def test_inertia_grows_with_mass() -> None:
    light, heavy = TOYS['lemon'], TOYS['lemon'].with_physics(HEAVY)
    factor = HEAVY.mass / light.physics.mass
    assert heavy.inertia == pytest.approx([factor * value for value in light.inertia])

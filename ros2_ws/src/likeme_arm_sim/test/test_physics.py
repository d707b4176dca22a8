"""Physical parameters reach the physics engine."""

from __future__ import annotations

from dataclasses import replace

import pytest

from likeme_arm_sim.cell import Cell, CellSettings
from likeme_arm_sim.physics import TOY_PHYSICS, GripperPhysics, HandPhysics, Physics
from likeme_arm_sim.scene import OBJECTS, Scene
from likeme_arm_sim.toys import TOYS

HEAVY = replace(TOY_PHYSICS['lemon'], mass=0.2, friction=0.3, rolling_friction=0.001)
OTHER = Physics(
    ground_friction=0.9,
    toys={'lemon': HEAVY},
    gripper=GripperPhysics(friction=0.2),
    hand=HandPhysics(mass=2.0),
)


@pytest.fixture(scope='module')
def cell() -> Cell:
    return Cell(Scene(), 1, CellSettings(physics=OTHER))


def dynamics(cell: Cell, body: int, link: int = -1) -> tuple[float, ...]:
    """Mass, friction, inertia, ... as bullet has them."""
    return tuple(cell.world.client.getDynamicsInfo(body, link))


def test_every_object_has_its_numbers() -> None:
    assert set(TOY_PHYSICS) == set(OBJECTS)


def test_numbers_of_a_cells_own_are_used(cell: Cell) -> None:
    mass, friction, inertia = dynamics(cell, cell.world.toys['lemon'])[:3]
    assert (mass, friction) == (HEAVY.mass, HEAVY.friction)
    assert inertia == pytest.approx(TOYS['lemon'].with_physics(HEAVY).inertia)
    assert dynamics(cell, cell.world.table)[1] == OTHER.ground_friction
    assert dynamics(cell, cell.arm.body, 9)[1] == OTHER.gripper.friction


def test_what_is_not_named_keeps_its_own(cell: Cell) -> None:
    pear = dynamics(cell, cell.world.toys['pear'])
    assert pear[:2] == (TOY_PHYSICS['pear'].mass, TOY_PHYSICS['pear'].friction)


def test_inertia_grows_with_mass() -> None:
    light, heavy = TOYS['lemon'], TOYS['lemon'].with_physics(HEAVY)
    factor = HEAVY.mass / light.physics.mass
    assert heavy.inertia == pytest.approx([factor * value for value in light.inertia])

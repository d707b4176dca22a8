"""Physical parameters: masses, frictions, forces.

Those of objects are in the world file, the fitted ones of the arm in `fitted_parameters.py`.

Bullet multiplies the friction coefficients of the two bodies that touch.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any

from likeme_arm.primitive_poses import PrimitiveSettings
from likeme_arm_sim.fitted_parameters import FITTED, TOY_FIELDS, fitted


@dataclass(frozen=True)
class ToyPhysics:
    """One toy.

    Attributes:
        mass: kg.
        friction: Coulomb coefficient.
        rolling_friction, spinning_friction: bullet's torsional coefficients, m.
        restitution: share of the normal velocity kept in a bounce.
        linear_damping, angular_damping: share of the velocity lost per second.
    """

    mass: float
    friction: float
    rolling_friction: float = 0.0010
    restitution: float = 0.2
    spinning_friction: float = 0.0008
    linear_damping: float = 0.02
    angular_damping: float = 0.02


@dataclass(frozen=True)
class GripperPhysics:
    """The robot's two fingers.

    Attributes:
        force: of each finger, N.
        speed: of each finger, m/s.
        friction: Coulomb coefficient of the pads.
        spinning_friction: bullet's torsional coefficient of the pads, m.
        gear_force: keeps both fingers equally far from the middle, N.
    """

    force: float = fitted('grip_force')
    speed: float = 0.1
    friction: float = 0.9
    spinning_friction: float = 0.002
    gear_force: float = 50.0


@dataclass(frozen=True)
class HandPhysics:
    """The person's hand.

    Attributes:
        mass: kg.
        drag_force: greatest force that moves the hand along its path, N.
        grip_force: greatest force between the hand and what it holds, N.
        friction: Coulomb coefficient, dry skin on plastic.
    """

    mass: float = 1.0
    drag_force: float = 250.0
    grip_force: float = 120.0
    friction: float = 1.6


@dataclass(frozen=True)
class ArmAccuracy:
    """Errors of the arm: calibration, play and reach.

    Attributes:
        bias_x, bias_y: of the hand-eye calibration in the middle of the work area, the same in
            every motion, m.
        skew: rotation of that calibration about the same point, rad.
        noise: standard deviation of x and of y, drawn once a motion, m.
        noise_z: the same of the height, m.
        turn: standard deviation of the hand's yaw, rad.
        reach: greatest distance of the grasp point from the base's axis, m; beyond it inverse
            kinematics finds no solution. The Panda's own reach is longer than the real robot's.
    """

    bias_x: float = fitted('arm_bias_x')
    bias_y: float = 0.0
    skew: float = fitted('arm_skew')
    noise: float = fitted('arm_noise')
    noise_z: float = 0.003
    turn: float = 0.10
    reach: float = fitted('reach')


def toy_physics(simulation: Mapping[str, Any]) -> ToyPhysics:
    """Physics of an object from its entry in the world file."""
    names = {field.name for field in fields(ToyPhysics)}
    return ToyPhysics(**{key: float(v) for key, v in simulation.items() if key in names})


def fitted_fields(name: str, parameters: Mapping[str, float]) -> dict[str, float]:
    """Fields of a toy's ToyPhysics by those fitted parameters that are its own."""
    keys = {field: f'{name}_{word}' for word, field in TOY_FIELDS.items()}
    return {field: parameters[key] for field, key in keys.items() if key in parameters}


def fitted_primitives(parameters: Mapping[str, float] | None = None) -> PrimitiveSettings:
    """Settings of the primitives, from the fitted parameters or other values of them."""
    own = {name: parameter.value for name, parameter in FITTED.items()}
    given = own if parameters is None else parameters
    return PrimitiveSettings(
        **{f.name: given[f.name] for f in fields(PrimitiveSettings) if f.name in given}
    )


@dataclass(frozen=True)
class Physics:
    """All physical parameters of a cell.

    Attributes:
        gravity: m/s^2, along z.
        ground_friction: Coulomb coefficient of the table top and of the floor.
        toys: by name; a toy that is not named has the world file's.
    """

    gravity: float = -9.81
    ground_friction: float = 0.6
    toys: Mapping[str, ToyPhysics] = field(default_factory=dict)
    gripper: GripperPhysics = field(default_factory=GripperPhysics)
    hand: HandPhysics = field(default_factory=HandPhysics)
    arm: ArmAccuracy = field(default_factory=ArmAccuracy)

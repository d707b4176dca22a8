"""Parameters of arm, primitives and objects that were fitted to the real robot's trials.

Values and ranges of the objects' are in the world file (`fit`). `place_share` and
`push_off_heading` describe the places of the regions; the world file has what follows from them.

All other values in `physics.py` and `primitives.py` were measured, looked up or chosen. The search
of `scripts/fit_physics.sh` (seed 1) starts at values chosen by hand. It varies one parameter at a
time over a few levels, makes 8 trials of each fitted row that the parameter can affect, and keeps
the level that agrees best. The final values agreed with 14 of the 18 fitted rows in 12 new trials
each, those after two steps with 13. Restitutions, grip_force, grasp_height, arm_bias_x, arm_noise
and push_past are not searched: they are as chosen.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

from likeme_core.world import World

_UNITS = {'mass': 'kg', 'rolling_friction': 'm'}
#: The fields of ToyPhysics that may be fitted, by their suffix in a fitted parameter's name.
TOY_FIELDS = {
    'friction': 'friction',
    'mass': 'mass',
    'rolling': 'rolling_friction',
    'bounce': 'restitution',
}


class FittedParameter(NamedTuple):
    """One fitted number.

    Attributes:
        value: the value of the default cell.
        low, high: range of the search.
        unit: of all three.
        meaning: what it describes.
    """

    value: float
    low: float
    high: float
    unit: str
    meaning: str


FITTED: Mapping[str, FittedParameter] = MappingProxyType(
    {
        'arm_bias_x': FittedParameter(0, -0.02, 0.02, 'm', 'hand-eye error, away from the robot'),
        'arm_skew': FittedParameter(
            -0.048, -0.08, 0.08, 'rad', 'hand-eye error, about the middle'
        ),
        'arm_noise': FittedParameter(
            0.008, 0.003, 0.016, 'm', 'sd of where a motion ends, x and y'
        ),
        'reach': FittedParameter(
            0.615, 0.56, 0.66, 'm', 'from the base, where the solver gives up'
        ),
        'grip_force': FittedParameter(1.95, 1.0, 4.0, 'N', 'of each finger'),
        'grasp_height': FittedParameter(
            0.034, 0.02, 0.044, 'm', 'of the grasp point when closing'
        ),
        'release_height': FittedParameter(
            0.0985, 0.03, 0.12, 'm', 'of the grasp point when opening'
        ),
        'place_share': FittedParameter(
            0.85, 0.4, 0.95, '', 'of the way from blue line to side border'
        ),
        'push_gap': FittedParameter(0.003, 0, 0.04, 'm', 'between the fingers while pushing'),
        'push_past': FittedParameter(
            0.01, 0, 0.03, 'm', 'further, once it is seen to have arrived'
        ),
        'push_off_heading': FittedParameter(
            -1.12, -1.4, 0, 'rad', 'of pushes off the table, from +x'
        ),
    }
)


def fitted(name: str) -> float:
    """The value of the default cell."""
    return FITTED[name].value


def object_parameters(world: World) -> dict[str, FittedParameter]:
    """The fitted parameters of a world's objects by name, with the ranges of the world file."""
    parameters = {}
    for word, key in TOY_FIELDS.items():
        for entry in world.object_entries:
            simulation = entry.simulation or {}
            span = simulation.get('fit', {}).get(key)
            if span is not None:
                low, high = map(float, span)
                unit = _UNITS.get(key, '')
                parameters[f'{entry.name}_{word}'] = FittedParameter(
                    float(simulation[key]), low, high, unit, f'{key} of {entry.name}'
                )
    return parameters


def fitted_parameters(world: World) -> dict[str, FittedParameter]:
    """All fitted parameters of a cell by name: of the objects, then of the arm."""
    return object_parameters(world) | dict(FITTED)


def fitted_values(world: World) -> dict[str, float]:
    """The values of the default cell of a world by name."""
    return {name: parameter.value for name, parameter in fitted_parameters(world).items()}

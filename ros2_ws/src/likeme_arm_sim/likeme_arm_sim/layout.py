"""Random places for objects within given states, as an experimenter would choose them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from likeme_core.geometry import Rectangle
from likeme_core.tabletop import State
from likeme_core.world import World

# Least distance between the centres of two toys, m.
SPACING = 0.13
TRIES = 300


class Placement(NamedTuple):
    """Where a toy is put: x, y and height of the ground there, m; yaw, rad."""

    x: float
    y: float
    ground: float
    yaw: float


def checked_states(
    world: World, objects: Sequence[str], states: Sequence[int | str]
) -> dict[str, State]:
    """States by object name, validated.

    Raises:
        ValueError: unknown objects or states, or not one state an object.
    """
    if len(objects) != len(states):
        raise ValueError(f'Expected {len(objects)} states, one an object, got {len(states)}.')
    for name in objects:
        world.object(name)
    if len(set(objects)) != len(objects):
        raise ValueError(f'Expected each object once, got {len(objects)} names, some twice.')
    return {name: world.state(state) for name, state in zip(objects, states, strict=True)}


def draw_layout(
    world: World,
    states: Mapping[str, State],
    occupied: list[NDArray[np.float64]],
    rng: np.random.Generator,
) -> dict[str, Placement]:
    """A placement for each named toy in its state, apart from the others and from `occupied`."""
    taken, layout = list(occupied), {}
    for name, state in states.items():
        x, y = _free_spot(world.region(state).start, taken, rng)
        taken.append(np.array([x, y]))
        ground = 0.0 if world.table.top.contains(x, y) else world.table.floor_z
        layout[name] = Placement(x, y, ground, float(rng.uniform(-np.pi, np.pi)))
    return layout


def _free_spot(
    area: Rectangle, taken: list[NDArray[np.float64]], rng: np.random.Generator
) -> tuple[float, float]:
    low, high = (area.x_min, area.y_min), (area.x_max, area.y_max)
    spots = rng.uniform(low, high, (TRIES, 2))
    if taken:
        room = np.linalg.norm(spots[:, None] - np.array(taken)[None], axis=2).min(axis=1)
        # The first free one; if none is free, the one with most room.
        spot = spots[int(np.argmax(room > SPACING) if room.max() > SPACING else room.argmax())]
    else:
        spot = spots[0]
    return float(spot[0]), float(spot[1])

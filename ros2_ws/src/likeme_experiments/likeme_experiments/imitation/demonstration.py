"""Cells with one object or all, and a human action in one of them as perception reports it."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache

import numpy as np

from likeme_arm_sim.cell import Cell, CellSettings
from likeme_core.observations import Demonstration
from likeme_core.outcomes import Actor
from likeme_core.tabletop import Action, State
from likeme_core.world import World
from likeme_experiments.evaluation.forecast import DemonstrationCase
from likeme_experiments.learning.cell_perception import CellPerception
from likeme_experiments.learning.trial_cell import BODY_SEED
from likeme_perception.background import Background
from likeme_perception.catalogue import world_catalogue
from likeme_perception.config import world_config

#: Physics steps between frames during a human action: 12 Hz, as in the shipped recordings.
STEPS_PER_FRAME = 20
#: Separates the draw of the other objects' states from that of their places.
OTHERS_STREAM = 3
#: s of frames before the human action and after it.
LEAD_IN, LEAD_OUT = 0.5, 1.5


@contextmanager
def temporary_cell(world: World, name: str, together: bool = False) -> Iterator[Cell]:
    """A new cell with one object, like the one in which the robot learned; closed at the end.

    together: with all objects of the world.

    A human grasp changes the order in which bullet solves its constraints for good, so that later
    motions differ by rounding even after a restart: a cell with a human action is not used again.
    """
    # A cell holds tens of MB in reference cycles: free the last one before making another.
    gc.collect()
    own = world if together else world.only(name)
    cell = Cell(own, BODY_SEED, CellSettings(initial_states={}))
    try:
        yield cell
    finally:
        cell.physics_world.client.disconnect()


@lru_cache(maxsize=16)
def background_of(world: World, name: str) -> Background:
    """The background of the scene at rest, learned once for each object in a process."""
    with temporary_cell(world, name) as cell:
        cell.restart(BODY_SEED)
        return new_perception(world, cell, None).learn_background()


def new_perception(world: World, cell: Cell, background: Background | None) -> CellPerception:
    """Perception of a cell without tracks, which knows all objects of the world."""
    return CellPerception(cell, world_config(world), world_catalogue(world), background)


def set_up(cell: Cell, name: str, x_i: State, seed: int) -> None:
    """Restart the cell with the object in x_i; others, if it has any, in drawn states in reach."""
    others = [other for other in cell.world.objects if other != name]
    reachable = [state for state in cell.world.states if state not in cell.world.out_of_reach]
    drawn = np.random.default_rng([seed, OTHERS_STREAM]).integers(len(reachable), size=len(others))
    cell.restart(seed)
    cell.reset([name, *others], [x_i, *(reachable[int(number)] for number in drawn)], seed)


def demonstrate(
    world: World, case: DemonstrationCase, seed: int, together: bool = False
) -> tuple[Demonstration, ...]:
    """Demonstrate a case in a new cell; the demonstrations perception reports, in order."""
    action = world.action_of(case.manner, case.x_f)
    assert action is not None, "Cases are of the world's actions."
    with temporary_cell(world, case.object, together) as cell:
        set_up(cell, case.object, case.x_i, seed)
        perception = new_perception(world, cell, background_of(world, case.object))
        return human_action(cell, perception, case.object, action)


def human_action(
    cell: Cell, perception: CellPerception, name: str, action: Action
) -> tuple[Demonstration, ...]:
    """Run one human action; the demonstrations perception reports."""
    found: list[Demonstration] = []

    def tick() -> None:
        if cell.physics_world.steps % STEPS_PER_FRAME == 0:
            found.extend(perception.process_frame().demonstrations)

    cell.step(LEAD_IN, tick)
    # The simulated human knows the true poses and needs no camera.
    cell.run_action(Actor.HUMAN, name, action, lambda _: None, tick)
    cell.step(LEAD_OUT, tick)
    return tuple(found)

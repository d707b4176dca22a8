"""A person's act in a cell, and what perception makes of it."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache

from likeme_arm_sim.cell import Cell, CellSettings
from likeme_arm_sim.scene import Scene
from likeme_core.observations import Demonstration
from likeme_core.outcomes import Actor
from likeme_core.tabletop import Action
from likeme_experiments.evaluation.forecast import Case
from likeme_experiments.learning.observed_cell import Eyes
from likeme_experiments.learning.trial_cell import BODY_SEED
from likeme_perception.background import Background
from likeme_perception.config import PerceptionConfig
from likeme_perception.identification import load_catalogue

#: Physics steps between frames while a person acts: 12 Hz, as in the shipped recordings.
STEPS_PER_FRAME = 20
#: s of an empty scene before the hand comes and after it left, for perception to be sure.
BEFORE, AFTER = 0.5, 1.5


def new_cell(name: str) -> Cell:
    """A cell with one object in it, like the one in which the robot learned."""
    return Cell(Scene(objects=(name,)), BODY_SEED, CellSettings(initial_states={}))


@contextmanager
def lone_cell(name: str) -> Iterator[Cell]:
    """A new cell for a person to act in; ends at the end.

    A person's grip changes the order in which bullet solves its constraints for good, so a cell in
    which a person acted goes another way afterwards but for rounding: it is not used again.
    """
    # A cell is a knot of references, tens of MB of them: the last one goes before the next comes.
    gc.collect()
    cell = new_cell(name)
    try:
        yield cell
    finally:
        cell.world.client.disconnect()


@cache
def background_of(name: str) -> Background:
    """What the camera sees of a scene in which nothing moves, learned once in a process."""
    with lone_cell(name) as cell:
        cell.restart(BODY_SEED)
        return eyes_on(cell, None).learn_background()


def eyes_on(cell: Cell, background: Background | None) -> Eyes:
    """Fresh eyes on a cell."""
    return Eyes(cell, PerceptionConfig(), load_catalogue(), background)


def shown(case: Case, seed: int) -> tuple[Demonstration, ...]:
    """A person shows a case in a cell; what perception understands of it, in order."""
    with lone_cell(case.object) as cell:
        cell.restart(seed)
        cell.reset([case.object], [case.x_i], seed)
        eyes = eyes_on(cell, background_of(case.object))
        return by_hand(cell, eyes, case.object, Action.of(case.manner, case.x_f))


def by_hand(cell: Cell, eyes: Eyes, name: str, action: Action) -> tuple[Demonstration, ...]:
    """A person does something; the acts that perception found."""
    acts: list[Demonstration] = []

    def tick() -> None:
        if cell.world.steps % STEPS_PER_FRAME == 0:
            table = eyes.see()
            acts.extend(table.demonstrations)

    cell.step(BEFORE, tick)
    cell.run_action(Actor.HUMAN, name, action, _no_need, tick)
    cell.step(AFTER, tick)
    return tuple(acts)


def _no_need(_: str) -> None:
    """People have eyes."""

"""The rows of the real robot's table, and their split into fitted and held-out ones."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from likeme_core.paper_world import LEFT, RIGHT, WORLD
from likeme_core.tabletop import Action, State
from likeme_inference.tabletop.model_file import shipped

# Chosen before the first fit. A row is idle when its object is already where the action aims. Held
# out are the idle rows and, of the four others of each object and manner, one drawn by this seed.
SPLIT_SEED = 2015


class TableRow(NamedTuple):
    """One object, x_i and action, with the real robot's counts of LEFT, RIGHT, OFFTABLE."""

    name: str
    x_i: State
    action: Action
    real: tuple[int, int, int]

    @property
    def idle(self) -> bool:
        """Whether the object is already where the action aims."""
        return self.action.target == self.x_i

    def __str__(self) -> str:
        return f'{self.name} {self.x_i.name} {self.action.name}'


def table_rows() -> list[TableRow]:
    """The 36 rows whose x_i is LEFT or RIGHT."""
    table = shipped()
    found = []
    for name in WORLD.objects:
        counts = table.model_of(name).counts
        for x_i in (LEFT, RIGHT):
            for action in WORLD.actions:
                left, right, off = map(int, counts[x_i, action])
                found.append(TableRow(name, x_i, action, (left, right, off)))
    return found


def split(table: list[TableRow]) -> tuple[list[TableRow], list[TableRow]]:
    """The 18 rows that are fitted, and the 18 that are held out."""
    rng = np.random.default_rng(SPLIT_SEED)
    held = {row for row in table if row.idle}
    for name in WORLD.objects:
        for manner in WORLD.manners:
            busy = [
                row
                for row in table
                if row.name == name and row.action.manner is manner and not row.idle
            ]
            held.add(busy[int(rng.integers(len(busy)))])
    return [row for row in table if row not in held], [row for row in table if row in held]

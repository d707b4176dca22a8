"""The parts of the cell that can each be simulated or real."""

from __future__ import annotations

from collections.abc import Iterable
from enum import StrEnum


class SimulatedPart(StrEnum):
    """A value of the arm driver's parameter `simulate`."""

    ARM = 'arm'
    PERSON = 'person'
    CAMERA = 'camera'


ALL_PARTS = frozenset(SimulatedPart)


def simulated_parts(names: Iterable[str]) -> frozenset[SimulatedPart]:
    """Parts by their names.

    Raises:
        ValueError: an unknown name, or none.
    """
    known = ', '.join(SimulatedPart)
    parts = set()
    for name in names:
        if name not in tuple(SimulatedPart):
            raise ValueError(f"Expected simulate to name parts of {known}, got '{name}'.")
        parts.add(SimulatedPart(name))
    if not parts:
        raise ValueError(f'Expected simulate to name at least one of {known}, got none.')
    return frozenset(parts)

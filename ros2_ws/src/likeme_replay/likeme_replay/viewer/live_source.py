"""Which running cell `view --live` shows."""

from __future__ import annotations

from typing import NamedTuple


class LiveSource(NamedTuple):
    """The options of the command line.

    Attributes:
        domain, network: where to look for the cell.
        world: its name or file; None: the shipped world whose name the cell says.
        seconds: to show; None: no end.
    """

    domain: int
    network: bool
    world: str | None
    seconds: float | None

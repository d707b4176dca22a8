"""Command-line values that name a member of an enum, in lower case."""

from __future__ import annotations

from enum import Enum
from typing import TypeVar

import typer

E = TypeVar('E', bound=Enum)


def choices(enum: type[Enum]) -> str:
    """The names for a help text, e.g. 'left, right or offtable'."""
    *first, last = (member.name.lower() for member in enum)
    return f'{", ".join(first)} or {last}'


def member(enum: type[E], name: str) -> E:
    """The member of a name, e.g. Action.PUSH_LEFT of 'push_left'.

    Raises:
        typer.BadParameter: there is none of this name.
    """
    by_name = {each.name.lower(): each for each in enum}
    if name not in by_name:
        raise typer.BadParameter(f'expected {choices(enum)}, got {name!r}.')
    return by_name[name]

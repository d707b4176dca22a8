"""A Typer application that reads and prints the same with the Typer of Ubuntu 24.04 (0.9)."""

from __future__ import annotations

from collections.abc import Callable
from types import UnionType
from typing import Annotated, Any, Optional, TypeVar, get_args, get_origin, get_type_hints

import typer
import typer.core

Function = TypeVar('Function', bound=Callable[..., Any])

if hasattr(typer.core, 'rich'):
    # Before 0.12 rich_markup_mode=None leaves the boxes around help and errors.
    typer.core.rich = None


class App(typer.Typer):
    """A Typer whose functions may have parameters of the type X | None."""

    def command(self, *args: Any, **options: Any) -> Callable[[Function], Function]:
        """See typer.Typer.command."""
        register = super().command(*args, **options)
        return lambda function: register(with_optionals(function))

    def callback(self, *args: Any, **options: Any) -> Callable[[Function], Function]:
        """See typer.Typer.callback."""
        register = super().callback(*args, **options)
        return lambda function: register(with_optionals(function))


def with_optionals(function: Function) -> Function:
    """The function, its annotations X | None as Optional[X], which Typer 0.9 reads alone."""
    hints = get_type_hints(function, include_extras=True)
    function.__annotations__ = {name: _optional(hint) for name, hint in hints.items()}
    return function


def _optional(hint: Any) -> Any:
    if get_origin(hint) is Annotated:
        kind, *extras = get_args(hint)
        return Annotated[(_optional(kind), *extras)]
    if isinstance(hint, UnionType):
        kinds = [kind for kind in get_args(hint) if kind is not type(None)]
        # A union of more is Typer's to refuse.
        return Optional[kinds[0]] if len(kinds) == 1 else hint  # noqa: UP045
    return hint

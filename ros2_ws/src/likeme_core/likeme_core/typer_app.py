"""A Typer application that reads and prints the same with the Typer of Ubuntu 24.04 (0.9).

A usage error is one line with the name that the program was called by.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Optional, TypeVar, cast, get_args, get_origin, get_type_hints

import typer
import typer.core

Function = TypeVar('Function', bound=Callable[..., Any])

if hasattr(typer.core, 'rich'):
    # Before 0.12 rich_markup_mode=None leaves the boxes around help and errors.
    typer.core.rich = None


#: Of click, or of the copy of it that newer versions of Typer bring along.
UsageError = cast(
    type[typer.BadParameter],
    next(kind for kind in typer.BadParameter.__mro__ if kind.__name__ == 'UsageError'),
)
USAGE = 2


def program_name() -> str:
    """What this program was called by, see also likeme_core.program."""
    return Path(sys.argv[0]).name


def usage_sentence(error: typer.BadParameter) -> str:
    """What is wrong with the arguments, in one line: what was expected and what was got.

    Newer versions of Typer leave out what was got; it is in the error that caused theirs.
    """
    sentence = ' '.join(error.format_message().split())
    problems: Any = getattr(error.__cause__, 'errors', list)
    for problem in problems()[:1]:
        said = ' '.join(problem['msg'].split())
        wanted = said.removeprefix('Input should be ').partition(', unable')[0]
        if wanted != said:
            number = 'a number ' if wanted.startswith(('greater', 'less')) else ''
            told = f'expected {number}{wanted}, got {problem["input"]!r}.'
            return sentence.replace(said, told)
        return sentence.replace('Value error, ', '')
    return sentence


def command_follows(context: typer.Context) -> bool:
    """Whether a command of the program was named; it does not take options from before its name.

    Raises:
        UsageError: there are some.
    """
    name = context.invoked_subcommand
    if name is None:
        return False
    for option in context.command.params:
        source: Any = context.get_parameter_source(option.name or '')
        if source is not None and source.name == 'COMMANDLINE':
            raise UsageError(f'expected {option.opts[0]} after {name}, got it before.')
    return True


@contextmanager
def _usage_errors_in_one_line() -> Iterator[None]:
    try:
        yield
    except UsageError as error:
        if type(error).__name__ == 'NoArgsIsHelpError':
            raise
        name = error.ctx.command_path if error.ctx else program_name()
        print(f'{name}: {usage_sentence(error)}', file=sys.stderr)  # noqa: T201
        sys.exit(USAGE)


class _OneLine:
    """Of a command that says what is wrong with its arguments in one line."""

    def make_context(self, *args: Any, **extra: Any) -> Any:
        """See click.Command.make_context."""
        with _usage_errors_in_one_line():
            return super().make_context(*args, **extra)  # type: ignore[misc]

    def invoke(self, ctx: Any) -> Any:
        """See click.Command.invoke."""
        with _usage_errors_in_one_line():
            return super().invoke(ctx)  # type: ignore[misc]


class OneLineCommand(_OneLine, typer.core.TyperCommand):
    """A command with usage errors of one line."""


class OneLineGroup(_OneLine, typer.core.TyperGroup):
    """A group of commands with usage errors of one line."""


class App(typer.Typer):
    """A Typer whose functions may have parameters of the type X | None."""

    def __init__(self, *args: Any, **options: Any) -> None:
        """See typer.Typer."""
        super().__init__(*args, **{'cls': OneLineGroup} | options)

    def __call__(self, *args: Any, **options: Any) -> Any:
        """See typer.Typer."""
        return super().__call__(*args, **{'prog_name': program_name()} | options)

    def command(self, *args: Any, **options: Any) -> Callable[[Function], Function]:
        """See typer.Typer.command."""
        register = super().command(*args, **{'cls': OneLineCommand} | options)
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

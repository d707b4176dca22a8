"""What the commands of the desk have in common: a node, exit codes, text or JSON."""

from __future__ import annotations

import json
import os
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Annotated, Any, NoReturn

import typer

from likeme_core.cli import user_name
from likeme_operator.operator_node import OperatorNode, ServiceAbsentError, operator_node

Name = Annotated[
    str,
    typer.Option(
        '--by',
        help='Name of the operator.',
        default_factory=user_name,
        show_default='the user name',
    ),
]
Json = Annotated[bool, typer.Option('--json', help='One JSON document.')]
#: Exit code of a command whose reader has gone, as the shell reports SIGPIPE.
BROKEN_PIPE = 141


def emit(as_json: bool, data: Any, text: str) -> None:
    """Print a result."""
    with reader():
        typer.echo(json.dumps(data, indent=2, allow_nan=False) if as_json else text)


@contextmanager
def reader() -> Iterator[None]:
    """What is written in here is read by a program that may end first: exit code 141."""
    try:
        yield
    except BrokenPipeError:
        # Python flushes stdout once more at its end.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        raise typer.Exit(BROKEN_PIPE) from None


@contextmanager
def interruptible() -> Iterator[None]:
    """Ctrl-C and SIGTERM end what is done in here with a line and exit code 0."""
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    except KeyboardInterrupt:
        typer.echo('Bye.', err=True)
        raise typer.Exit(0) from None
    finally:
        signal.signal(signal.SIGTERM, before)


def fail(code: int, sentence: str, as_json: bool = False) -> NoReturn:
    """Say what is wrong at stderr, and end; with --json also as a document at stdout."""
    if as_json:
        typer.echo(json.dumps({'error': sentence, 'code': code}))
    typer.echo(sentence, err=True)
    raise typer.Exit(code)


@contextmanager
def connected(
    by: str,
    network: bool,
    domain: int,
    as_json: bool = False,
    create: Callable[[str], Any] = OperatorNode,
) -> Iterator[Any]:
    """A node for one command; Ctrl-C, an absent service and a broken pipe set the exit code."""
    with interruptible(), reader():
        try:
            with operator_node(by, network, domain, create) as node:
                yield node
        except ServiceAbsentError as error:
            fail(3, str(error), as_json)

"""The command line `operator`: the desk of a running cell, and its one-shot commands.

Exit codes: 0 done, 1 refused or not in service, 2 wrong usage, 3 no cell is running.
"""

from __future__ import annotations

import os
import sys
from typing import Annotated, NoReturn

import typer

from likeme_bringup.ros.status_command import status_command
from likeme_core.cli import Domain, Network
from likeme_core.typer_app import App, command_follows
from likeme_operator.ros.command_output import Name, fail
from likeme_operator.ros.hold_commands import hold_command, resume_command
from likeme_operator.ros.line_mode import line_mode
from likeme_operator.ros.question_commands import answer_command, list_command
from likeme_operator.ros.watch_command import watch_command
from likeme_operator.ros.what_if_command import what_if_command
from likeme_operator.terminal_desk import DRAWS, run_in_terminal

app = App(
    help="The operator's desk of a running cell. Without a command: the screen.",
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
app.command('list')(list_command)
app.command('answer')(answer_command)
app.command('whatif')(what_if_command)
app.command('hold')(hold_command)
app.command('resume')(resume_command)
app.command('watch')(watch_command)
app.command('status')(status_command)


#: Their words are those of another command line.
PASSED_ON = {'ignore_unknown_options': True, 'allow_extra_args': True, 'help_option_names': []}


@app.command('why', context_settings=PASSED_ON)
def why_command(context: typer.Context) -> None:
    """Tell how a decision came about and ended, from the decision log."""
    _of_the_log('why', context.args)


@app.command('log', context_settings=PASSED_ON)
def log_command(context: typer.Context) -> None:
    """Print the newest entries of the decision log."""
    _of_the_log('show', context.args)


def _of_the_log(command: str, words: list[str]) -> NoReturn:
    # SQLAlchemy takes 0.3 s to import.
    from likeme_inference.log_commands import app as log_app

    log_app([command, *words])
    raise typer.Exit(0)


@app.callback(invoke_without_command=True)
def desk(
    context: typer.Context,
    by: Name,
    plain: Annotated[
        bool, typer.Option('--plain', help='Lines instead of a screen: pipes, screen readers.')
    ] = False,
    web: Annotated[
        bool, typer.Option('--web', help='The screen in a browser of this host.')
    ] = False,
    port: Annotated[int, typer.Option(min=1, max=65535, help='TCP port of --web.')] = 8000,
    skip_after: Annotated[
        float,
        typer.Option(
            min=0, help='s after which the screen skips a question nobody answered; 0: never.'
        ),
    ] = 0.0,
    network: Network = False,
    domain: Domain = 0,
) -> None:
    """Open the desk, or run one command of it."""
    if command_follows(context):
        return
    if plain or not (web or screen_there()):
        line_mode(by, network, domain)
        return
    try:
        if web:
            from likeme_operator.screen.serve_desk import serve_desk

            serve_desk(by, network, domain, skip_after, port)
        elif 'TEXTUAL_DRIVER' in os.environ or DRAWS in os.environ:
            from likeme_operator.screen.run_desk import run_desk

            run_desk(by, network, domain, skip_after)
        else:
            run_in_terminal(by, network, domain, sys.argv[1:])
    except ModuleNotFoundError as error:
        if (error.name or '').partition('.')[0] not in ('textual', 'textual_serve', 'aiohttp'):
            raise
        fail(2, 'The screen needs textual: scripts/operator.sh installs it. --plain does without.')


def screen_there() -> bool:
    """Whether there is a terminal, or a browser that stands for one."""
    return 'TEXTUAL_DRIVER' in os.environ or (sys.stdin.isatty() and sys.stdout.isatty())


def main() -> None:
    """Run the command line."""
    app()


if __name__ == '__main__':
    main()

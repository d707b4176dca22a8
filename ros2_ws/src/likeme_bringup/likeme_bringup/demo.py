"""The demo: starts the cell, runs the paper's two acts in it, and draws what the camera saw."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from enum import StrEnum
from itertools import cycle
from pathlib import Path
from typing import Annotated, Any

import typer
from domain_coordinator import domain_id
from rich.console import Console

from likeme_bringup import narration
from likeme_bringup.demo_acts import DemoAct, demo_act, story_acts
from likeme_bringup.demo_node import DemoStoppedError, Operator, run_acts
from likeme_bringup.enum_choice import choices, member
from likeme_bringup.start_cell import Part
from likeme_bringup.storyboard import draw_storyboard
from likeme_core.cli import MAX_SEED, WORLD_DEFAULT, WorldOption, user_name
from likeme_core.instance_lock import is_free
from likeme_core.interrupt import deferred_interrupt
from likeme_core.processes import die_with_parent, interrupt
from likeme_core.progress_bar import StatusLine
from likeme_core.state_folder import STATE_VARIABLE
from likeme_core.tabletop import Manner
from likeme_core.typer_app import App
from likeme_core.world import World
from likeme_inference.console_replies import TypedAnswer, read_answer
from likeme_inference.keyboard import DISCARDED, Keyboard
from likeme_inference.node_settings import read_model
from likeme_inference.tabletop.values import Reply, RequestKind

console = Console(highlight=False, soft_wrap=False)
CELL_EXIT_TIMEOUT = 20.0
INTERRUPTED = 130
# Between two checks that the demo still goes on while it waits for the keyboard, s.
POLL_PERIOD = 0.2


class Answerer(StrEnum):
    """Who answers when the robot asks for help."""

    AUTO = 'auto'
    ME = 'me'


def main(
    seed: Annotated[
        int,
        typer.Option(min=0, max=MAX_SEED, help='Draws the positions, the hand and the noise.'),
    ] = 10,
    object_: Annotated[
        str | None,
        typer.Option('--object', help='Show an act with this object instead of the story.'),
    ] = None,
    show: Annotated[
        # Typer 0.9 does not read a pair that may be None.
        tuple[str, str],
        typer.Option(
            metavar='FROM TO',
            help='What the person shows: two regions of the world.',
            show_default=False,
        ),
    ] = ('', ''),
    by: Annotated[
        str, typer.Option(help=f'How the person shows it: {choices(Manner)}.')
    ] = 'place',
    operator: Annotated[
        Answerer,
        typer.Option(help='Who answers the robot: the simulated person, or you at this keyboard.'),
    ] = Answerer.AUTO,
    model: Annotated[
        Path | None,
        typer.Option(exists=True, dir_okay=False, help='Another transition model file.'),
    ] = None,
    world: WorldOption = WORLD_DEFAULT,
    out: Annotated[
        Path, typer.Option(help='Folder for the picture and the log of the nodes.')
    ] = Path('out/demo'),
) -> None:
    """Run the paper's example: the robot watches, infers the goal, acts its own way, or asks.

    Exit code 0: every act reached the goal that was shown. 1: one did not, or the demo stopped.
    130: Ctrl-C or SIGTERM.
    """
    acts = _acts(world, object_, show if any(show) else None, member(Manner, by))
    _check_model(world, model, acts)
    log = _log_in(out)
    try:
        with deferred_interrupt(signal.SIGINT, signal.SIGTERM) as check_signal:
            reached = _run(world, acts, seed, operator, model, log, check_signal)
    except KeyboardInterrupt:
        _tell('The demo stops here. Interrupted.')
        raise typer.Exit(INTERRUPTED) from None
    raise typer.Exit(0 if reached else 1)


def _run(
    world: World,
    acts: Sequence[DemoAct],
    seed: int,
    operator: Answerer,
    model: Path | None,
    log: Path,
    check_signal: Callable[[], None],
) -> bool:
    """Run the acts in a cell and draw what the camera saw; whether every act reached its goal."""
    began = time.monotonic()
    with domain_id(_free_domain()) as domain, _cell(world, domain, seed, model, log) as check_cell:

        def check() -> None:
            # First, as Ctrl-C in a terminal ends the cell, too.
            check_signal()
            check_cell()

        with ExitStack() as starting:
            starting.enter_context(StatusLine('The cell starts').shown())

            def tell(sentence: str) -> None:
                starting.close()
                _tell(sentence)

            results, rows = run_acts(world, acts, seed, tell, _operator(operator), check)
    seconds = time.monotonic() - began
    _tell('\n' + narration.summary(results, len(acts), seconds))
    if any(row.panels for row in rows):
        _tell(f'What the camera saw: {draw_storyboard(rows, log.parent / "story.png")}')
    _tell(f'Log of the nodes: {log}')
    return len(results) == len(acts) and all(result.reached for result in results)


def _acts(
    world: World, name: str | None, show: tuple[str, str] | None, by: Manner
) -> Sequence[DemoAct]:
    """The story of the world, or the one act that the options name."""
    try:
        if name is None and show is None and by is Manner.PLACE:
            return story_acts(world)
        first = story_acts(world)[0] if world.story else None
        if first is None and (name is None or show is None):
            raise ValueError('Expected --object and --show, as the world has no story.')
        start, end = (
            (first.start, first.end)
            if show is None and first is not None
            else tuple(world.state(word) for word in show or ())
        )
        return (demo_act(world, name or (first.object if first else ''), start, end, by),)
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint='--show') from None


def _check_model(world: World, path: Path | None, acts: Sequence[DemoAct]) -> None:
    """Refuse a model file that cannot be read, and objects that the robot never tried."""
    try:
        known = list(read_model(str(path or ''), world).objects)
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint='--model') from None
    for act in acts:
        if act.object not in known:
            hint, more = ('--model', '; choose one by --object') if path else ('--object', '')
            raise typer.BadParameter(
                f'the robot has tried {", ".join(known)}, not {act.object}{more}', param_hint=hint
            )


def _log_in(out: Path) -> Path:
    """Make the folder and the file for the output of the nodes."""
    log = out / 'cell.log'
    try:
        out.mkdir(parents=True, exist_ok=True)
        log.touch()
    except OSError as error:
        raise typer.BadParameter(
            f'{error.filename}: {error.strerror}', param_hint='--out'
        ) from None
    return log


def _free_domain() -> Callable[[], int]:
    """Give one ROS domain after another on which no cell of this host runs."""
    return filter(lambda number: is_free(number, Part), cycle(range(1, 101))).__next__


@contextmanager
def _cell(
    world: World, domain: int, seed: int, model: Path | None, log: Path
) -> Iterator[Callable[[], None]]:
    """Run the nodes as `start_cell` does; yields a check that raises if they ended.

    What this cell has to remember ends with it: the domain's own cell may be held, or have asked.
    """
    os.environ['ROS_DOMAIN_ID'] = str(domain)
    command = [sys.executable, '-m', 'likeme_bringup.start_cell', '--seed', str(seed)]
    # The story needs all that the nodes know: a part that died is told, not mended.
    command += ['--world', world.source, '--no-respawn']
    if model is not None:
        command += ['--model', str(model.resolve())]
    with tempfile.TemporaryDirectory(prefix='likeme_demo_') as state:
        with log.open('w') as sink:
            cell = subprocess.Popen(
                command,
                stdout=sink,
                stderr=subprocess.STDOUT,
                env=os.environ | {STATE_VARIABLE: state},
                preexec_fn=die_with_parent(os.getpid()),
            )

        def check_cell() -> None:
            if cell.poll() is not None:
                raise typer.Exit(_report_dead_cell(cell.returncode, log))

        try:
            yield check_cell
        finally:
            interrupt(cell, CELL_EXIT_TIMEOUT)


def _report_dead_cell(code: int, log: Path) -> int:
    last = log.read_text(errors='replace').strip().splitlines()[-5:]
    console.print(f'The cell ended by itself (exit code {code}). Last lines of {log}:')
    console.print('\n'.join(last), markup=False)
    return 1


def _tell(sentence: str) -> None:
    console.print(sentence, markup=False)


def _operator(answerer: Answerer) -> Operator:
    if answerer is Answerer.AUTO:
        return _simulated_person
    keyboard = None if sys.stdin is None else Keyboard(sys.stdin.fileno())
    return lambda request, check: _ask_at_keyboard(keyboard, check)


def _simulated_person(request: Any, _: Callable[[], None]) -> tuple[TypedAnswer, str]:
    """Clears the way where that is asked for, and does by hand whatever else is."""
    clear = request.kind == RequestKind.CLEAR_THE_WAY
    return TypedAnswer(Reply.TRY_ANYWAY if clear else Reply.DONE_BY_HAND), 'the simulated person'


def _ask_at_keyboard(
    keyboard: Keyboard | None, check: Callable[[], None]
) -> tuple[TypedAnswer, str]:
    if keyboard is not None and keyboard.discard():
        _tell(DISCARDED)
    _tell(
        '  done: you do it (the simulated hand moves for you); try: the robot tries; '
        'skip: leave it; goal REGION: that goal is meant'
    )
    while True:
        line = _line('Your answer (done, try, skip or goal REGION): ', keyboard, check)
        try:
            return read_answer(line), user_name()
        except ValueError as error:
            _tell(str(error))


def _line(prompt: str, keyboard: Keyboard | None, check: Callable[[], None]) -> str:
    """A line from the keyboard; `check` is called while it waits, and may raise."""
    print(prompt, end='', flush=True)
    try:
        if keyboard is None:
            raise EOFError
        # A blocking read would delay Ctrl-C, for which `check` raises, until the next Enter.
        while not keyboard.ready(POLL_PERIOD):
            check()
        return keyboard.line()
    except EOFError:
        _tell('')
        raise DemoStoppedError('Expected an answer at the keyboard, got end of file.') from None


def run() -> None:
    """Console entry point."""
    app = App(add_completion=False, rich_markup_mode=None)
    app.command()(main)
    app()


if __name__ == '__main__':
    run()

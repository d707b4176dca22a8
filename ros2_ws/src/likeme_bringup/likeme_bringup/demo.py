"""The demo: starts the cell, has the paper's story played in it, and draws what the camera saw."""

from __future__ import annotations

import getpass
import os
import select
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from enum import StrEnum
from itertools import cycle
from pathlib import Path
from typing import Annotated, Any

import typer
from domain_coordinator import domain_id
from rich.console import Console

from likeme_bringup import story
from likeme_bringup.demo_node import DONE_BY_HAND, Operator, StoryStoppedError, play_story
from likeme_bringup.ros.cell_commands import Manner
from likeme_bringup.ros.cell_commands import State as Side
from likeme_bringup.start_cell import Part
from likeme_bringup.storyboard import draw_storyboard
from likeme_core.instance_lock import is_free
from likeme_core.processes import die_with_parent, interrupt
from likeme_core.tabletop import State
from likeme_inference.console_replies import read_reply
from likeme_inference.node_settings import read_model

console = Console(highlight=False, soft_wrap=False)
END_OF_CELL_TIMEOUT = 20.0
# How often a question at the keyboard looks whether the story still goes on, s.
GLANCE = 0.2


class Who(StrEnum):
    """Who answers when the robot asks for help."""

    AUTO = 'auto'
    ME = 'me'


def main(
    seed: Annotated[int, typer.Option(help='Draws the positions, the hand and the noise.')] = 1,
    object_: Annotated[
        str | None, typer.Option('--object', help='pear, lemon or chicken, instead of the two.')
    ] = None,
    show: Annotated[
        tuple[Side, Side], typer.Option(metavar='FROM TO', help='What the person shows.')
    ] = (Side.RIGHT, Side.LEFT),
    by: Annotated[Manner, typer.Option(help='How the person shows it.')] = Manner.PLACE,
    operator: Annotated[
        Who,
        typer.Option(help='Who answers the robot: the simulated person, or you at this keyboard.'),
    ] = Who.AUTO,
    model: Annotated[
        Path | None,
        typer.Option(exists=True, dir_okay=False, help='Another transition model file.'),
    ] = None,
    out: Annotated[
        Path, typer.Option(help='Folder for the picture and the log of the nodes.')
    ] = Path('out/demo'),
) -> None:
    """Play the paper's story: the robot watches, infers the goal, reaches it its own way, or asks.

    Exit code 0: every act reached the goal that was shown. 1: one did not, or the story stopped.
    """
    acts = _acts(object_, show, by)
    _check_model(model, acts)
    log = _log_in(out)
    began = time.monotonic()
    with domain_id(_free_domain()) as domain, _cell(domain, seed, model, log) as alive:
        endings, rows = play_story(acts, seed, _tell, _operator(operator), alive)
    seconds = time.monotonic() - began
    _tell('\n' + story.summary(endings, len(acts), seconds))
    if any(row.panels for row in rows):
        _tell(f'What the camera saw: {draw_storyboard(rows, out / "story.png")}')
    _tell(f'What the nodes said: {log}')
    raise typer.Exit(0 if len(endings) == len(acts) and all(e.reached for e in endings) else 1)


def _acts(object_: str | None, show: tuple[Side, Side], by: Manner) -> Sequence[story.Act]:
    start, end = (State[side.name] for side in show)
    default = (start, end, by) == (State.RIGHT, State.LEFT, Manner.PLACE)
    if object_ is None and default:
        return story.PAPERS_STORY
    if start == end or start == State.OFFTABLE:
        raise typer.BadParameter(
            f'expected a change that starts on the table, got {start.name} to {end.name}',
            param_hint='--show',
        )
    return (story.Act(object_ or 'chicken', start, end, push=by == Manner.PUSH),)


def _check_model(path: Path | None, acts: Sequence[story.Act]) -> None:
    """Refuse a model file that cannot be read, and objects that the robot never tried."""
    try:
        known = list(read_model(str(path or '')).objects)
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint='--model') from None
    for act in acts:
        if act.object not in known:
            hint, more = ('--model', '; choose one by --object') if path else ('--object', '')
            raise typer.BadParameter(
                f'the robot has tried {", ".join(known)}, not {act.object}{more}', param_hint=hint
            )


def _log_in(out: Path) -> Path:
    """Make the folder, and the file for what the nodes say."""
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
def _cell(domain: int, seed: int, model: Path | None, log: Path) -> Iterator[Callable[[], None]]:
    """Run the three nodes as `start_cell` does; yields a check that raises once they ended."""
    os.environ['ROS_DOMAIN_ID'] = str(domain)
    command = [sys.executable, '-m', 'likeme_bringup.start_cell', '--seed', str(seed)]
    if model is not None:
        command += ['--model', str(model.resolve())]
    with log.open('w') as sink:
        cell = subprocess.Popen(
            command,
            stdout=sink,
            stderr=subprocess.STDOUT,
            preexec_fn=die_with_parent(os.getpid()),
        )

    def alive() -> None:
        if cell.poll() is not None:
            raise typer.Exit(_report_dead_cell(cell.returncode, log))

    try:
        yield alive
    finally:
        interrupt(cell, END_OF_CELL_TIMEOUT)


def _report_dead_cell(code: int, log: Path) -> int:
    last = log.read_text(errors='replace').strip().splitlines()[-5:]
    console.print(f'The cell ended by itself (exit code {code}). Its last words, from {log}:')
    console.print('\n'.join(last), markup=False)
    return 1


def _tell(sentence: str) -> None:
    console.print(sentence, markup=False)


def _operator(who: Who) -> Operator:
    if who is Who.AUTO:
        return lambda request, pause: (DONE_BY_HAND, 'the simulated person')
    return _ask_at_keyboard


def _ask_at_keyboard(request: Any, pause: Callable[[], None]) -> tuple[int, str]:
    _tell(
        '  done: you do it (the simulated hand moves for you); try: the robot tries; '
        'skip: leave it'
    )
    while True:
        line = _line('Your answer (done, try or skip): ', pause)
        try:
            return int(read_reply(line)), getpass.getuser()
        except ValueError as error:
            _tell(str(error))


def _line(prompt: str, pause: Callable[[], None]) -> str:
    """A line from the keyboard; `pause` may raise while nobody types."""
    print(prompt, end='', flush=True)
    # Blocking in a read here would swallow Ctrl-C, which rclpy handles, until the next Enter.
    while sys.stdin is not None and not select.select([sys.stdin], [], [], GLANCE)[0]:
        pause()
    line = '' if sys.stdin is None else sys.stdin.readline()
    if not line:
        _tell('')
        raise StoryStoppedError('Expected an answer at the keyboard, got its end.')
    return line


def run() -> None:
    """Console entry point."""
    app = typer.Typer(add_completion=False, rich_markup_mode=None)
    app.command()(main)
    app(prog_name='demo')


if __name__ == '__main__':
    run()

"""The command behind scripts/gaze.sh: a simulated mentor plays trials to a gaze node."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from typing import Annotated, Any

import numpy as np
import typer

from likeme_core.cli import Domain
from likeme_core.instance_lock import AlreadyRunningError, claim
from likeme_core.processes import running
from likeme_experiments.gaze_trials import HEADER, draw_trials, line, score, summary, turn_of
from likeme_experiments.ros.gaze_mentor_node import (
    GAZE_NODE,
    PATIENCE,
    START_PATIENCE,
    GazeNodeError,
    MentorNode,
    mentor,
)
from likeme_gaze.mentor.settings import Blindfold

#: s a gaze node has to end after SIGINT.
GRACE = 10.0
KNOWS = {
    Blindfold.NONE: 'never wore a blindfold',
    Blindfold.WINDOWED: 'wore a blindfold with windows',
    Blindfold.OPAQUE: 'wore an opaque blindfold',
}


def main(
    trials: Annotated[int, typer.Option(min=1, help='How often the mentor looks somewhere.')] = 4,
    blindfold: Annotated[
        bool, typer.Option('--blindfold', help='The mentor wears an opaque blindfold (Fig 6).')
    ] = False,
    experience: Annotated[
        Blindfold | None,
        typer.Option(
            help='What the robot knows of blindfolds; with --blindfold: none and opaque.'
        ),
    ] = None,
    distance: Annotated[
        bool,
        typer.Option('--distance', help="The robot also sees how far the mentor's eyes look."),
    ] = False,
    seed: Annotated[int, typer.Option(min=0, help='Of experience and mentor.')] = 1,
    points: Annotated[
        int, typer.Option(min=0, help='Head movements to learn from; 15 in Fig 6.')
    ] = 200,
    start: Annotated[
        bool, typer.Option('--start/--no-start', help='Start a gaze node, or use one that runs.')
    ] = True,
    domain: Domain = 0,
) -> None:
    """Let a simulated mentor look at targets, and see whether the robot follows its gaze.

    Exit code 0: all trials were answered. 1: one was not, or there is no gaze node. 2: usage.
    """
    groups = [experience] if experience else [Blindfold.NONE]
    if blindfold and not experience:
        groups = [Blindfold.NONE, Blindfold.OPAQUE]
    wanted = {'mentor_blindfolded': blindfold, 'use_distance': distance}
    # A name of its own: a second gaze node on this domain is not taken for it.
    name = f'{GAZE_NODE}_{os.getpid()}' if start else GAZE_NODE
    node = _own_node(name, domain, seed, points) if start else nullcontext(_nothing_known)
    try:
        with node as alive, mentor(domain, name, alive) as person:
            person.wait_until_ready(START_PATIENCE if start else PATIENCE)
            for group in groups:
                with person.parameters_set({**wanted, 'blindfold_experience': str(group)}):
                    _play(person, trials, seed, group, blindfold)
    except (GazeNodeError, AlreadyRunningError) as error:
        print(f'gaze: {error}', file=sys.stderr)
        raise typer.Exit(1) from None
    except KeyboardInterrupt:
        print('gaze: interrupted.', file=sys.stderr)
        raise typer.Exit(130) from None


def _play(person: MentorNode, count: int, seed: int, group: Blindfold, blindfold: bool) -> None:
    """Play all trials and print them."""
    scene, learned = person.scene(), person.parameters(('training_points',))
    eyes = 'under an opaque blindfold' if blindfold else 'with open eyes'
    print(
        f'\nThe robot learned from {learned["training_points"]} movements of its own head and '
        f'{KNOWS[group]}.\nA mentor {scene.away:.1f} m away turns its head by 45 degrees {eyes}, '
        f'{scene.observations} times a trial.\n{HEADER}'
    )
    scores = []
    # The same trials for every group.
    rng = np.random.default_rng([seed, 6])
    for number, trial in enumerate(draw_trials(rng, scene, count), start=1):
        reply = person.show(scene, trial)
        scores.append(score(trial, turn_of(scene, reply)))
        print(line(number, scene, trial, reply), flush=True)
    print(summary(scores))


@contextmanager
def _own_node(name: str, domain: int, seed: int, points: int) -> Iterator[Callable[[], None]]:
    """Run a gaze node; yields a check that raises once it has ended."""
    command = [sys.executable, '-m', 'likeme_gaze.gaze_node', '--ros-args']
    command += ['-r', f'__node:={name}', '-p', f'seed:={seed}', '-p', f'training_points:={points}']
    environment = {'ROS_DOMAIN_ID': str(domain)}
    with (
        claim(domain, ['gaze']),
        tempfile.TemporaryFile() as log,
        running(command, log, GRACE, environment) as process,
    ):
        yield lambda: _check(process, log)


def _check(process: subprocess.Popen[bytes], log: Any) -> None:
    """Raise once the node has ended, with its last words."""
    if process.poll() is None:
        return
    log.seek(0)
    said = log.read().decode(errors='replace').strip().splitlines()
    last = said[-1] if said else 'it said nothing.'
    raise GazeNodeError(f'The gaze node ended with exit code {process.returncode}: {last}')


def _nothing_known() -> None:
    """Whether a node that somebody else started still runs shows in its answers alone."""


def run() -> None:
    """Console entry point."""
    app = typer.Typer(add_completion=False, rich_markup_mode=None)
    app.command()(main)
    app(prog_name='gaze')


if __name__ == '__main__':
    run()

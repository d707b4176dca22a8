"""The command behind scripts/gaze.sh: gaze following of a simulated mentor over ROS."""

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
from likeme_core.typer_app import App
from likeme_experiments.evaluation.mentor_trials import (
    HEADER,
    draw_trials,
    line,
    score,
    summary,
    turn_of,
)
from likeme_experiments.ros.gaze_mentor_node import (
    DISCOVERY_TIMEOUT,
    GAZE_NODE,
    START_TIMEOUT,
    GazeNodeError,
    MentorNode,
    mentor,
)
from likeme_gaze.mentor.settings import BlindfoldExperience

#: s after SIGINT before SIGKILL.
SHUTDOWN_TIMEOUT = 10.0
EXPERIENCE = {
    BlindfoldExperience.NONE: 'never wore a blindfold',
    BlindfoldExperience.WINDOWED: 'wore a blindfold with windows',
    BlindfoldExperience.OPAQUE: 'wore an opaque blindfold',
}


def main(
    trials: Annotated[int, typer.Option(min=1, help='Number of trials.')] = 4,
    blindfold: Annotated[
        bool, typer.Option('--blindfold', help='The mentor wears an opaque blindfold (Fig 6).')
    ] = False,
    experience: Annotated[
        BlindfoldExperience | None,
        typer.Option(help='Blindfold the robot has worn; with --blindfold: none, then opaque.'),
    ] = None,
    distance: Annotated[
        bool,
        typer.Option(
            '--distance', help="The robot also observes the distance of the mentor's fixation."
        ),
    ] = False,
    seed: Annotated[
        int, typer.Option(min=0, help="Seed of the robot's experience and of the mentor.")
    ] = 1,
    points: Annotated[
        int, typer.Option(min=0, help='Head movements the robot learns from; 15 in Fig 6.')
    ] = 200,
    start: Annotated[
        bool, typer.Option('--start/--no-start', help='Start a gaze node, or use a running one.')
    ] = True,
    domain: Domain = 0,
) -> None:
    """Let a simulated mentor look at targets, and report whether the robot follows its gaze.

    Exit code 0: all trials were answered. 1: one was not, or there is no gaze node. 2: usage.
    """
    groups = [experience] if experience else [BlindfoldExperience.NONE]
    if blindfold and not experience:
        groups = [BlindfoldExperience.NONE, BlindfoldExperience.OPAQUE]
    wanted = {'mentor_blindfolded': blindfold, 'use_distance': distance}
    # A unique name: another gaze node on this domain is not mistaken for this one.
    name = f'{GAZE_NODE}_{os.getpid()}' if start else GAZE_NODE
    node = _own_node(name, domain, seed, points) if start else nullcontext(_not_monitored)
    try:
        with node as alive, mentor(domain, name, alive) as mentor_node:
            mentor_node.wait_until_ready(START_TIMEOUT if start else DISCOVERY_TIMEOUT)
            for group in groups:
                with mentor_node.parameters_set({**wanted, 'blindfold_experience': str(group)}):
                    _run_trials(mentor_node, trials, seed, group, blindfold)
    except (GazeNodeError, AlreadyRunningError) as error:
        print(f'gaze: {error}', file=sys.stderr)
        raise typer.Exit(1) from None
    except KeyboardInterrupt:
        print('gaze: interrupted.', file=sys.stderr)
        raise typer.Exit(130) from None


def _run_trials(
    mentor_node: MentorNode, count: int, seed: int, group: BlindfoldExperience, blindfold: bool
) -> None:
    """Run all trials and print them."""
    scene, learned = mentor_node.scene(), mentor_node.gaze_parameters(('training_points',))
    eyes = 'under an opaque blindfold' if blindfold else 'with open eyes'
    print(
        f'\nThe robot learned from {learned["training_points"]} movements of its own head and '
        f'{EXPERIENCE[group]}.\nA mentor {scene.away:.1f} m away turns its head by 45 degrees '
        f'{eyes}, {scene.observations} times a trial.\n{HEADER}'
    )
    scores = []
    # The same trials for every group.
    rng = np.random.default_rng([seed, 6])
    for number, trial in enumerate(draw_trials(rng, scene, count), start=1):
        response = mentor_node.run_trial(scene, trial)
        scores.append(score(trial, turn_of(scene, response)))
        print(line(number, scene, trial, response), flush=True)
    print(summary(scores))


@contextmanager
def _own_node(name: str, domain: int, seed: int, points: int) -> Iterator[Callable[[], None]]:
    """Run a gaze node; yields a function that raises once it has ended."""
    command = [sys.executable, '-m', 'likeme_gaze.gaze_node', '--ros-args']
    command += ['-r', f'__node:={name}', '-p', f'seed:={seed}', '-p', f'training_points:={points}']
    environment = {'ROS_DOMAIN_ID': str(domain)}
    with (
        claim(domain, ['gaze']),
        tempfile.TemporaryFile() as log,
        running(command, log, SHUTDOWN_TIMEOUT, environment) as process,
    ):
        yield lambda: _check(process, log)


def _check(process: subprocess.Popen[bytes], log: Any) -> None:
    """Raise once the node has ended, with its last line."""
    if process.poll() is None:
        return
    log.seek(0)
    lines = log.read().decode(errors='replace').strip().splitlines()
    last = lines[-1] if lines else '(no output)'
    raise GazeNodeError(f'The gaze node ended with exit code {process.returncode}: {last}')


def _not_monitored() -> None:
    """A node that was already running is not monitored; only its answers are awaited."""


def run() -> None:
    """Console entry point."""
    app = App(add_completion=False, rich_markup_mode=None)
    app.command()(main)
    app()


if __name__ == '__main__':
    run()

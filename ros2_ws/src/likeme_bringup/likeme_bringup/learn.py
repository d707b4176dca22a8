"""The command behind scripts/learn.sh: learn what actions do by trying, and keep what came."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable
from concurrent.futures.process import BrokenProcessPool
from contextlib import ExitStack, closing
from functools import partial
from pathlib import Path
from typing import Annotated, NamedTuple

import typer
from rich.console import Console

from likeme_arm_sim.scene import OBJECTS
from likeme_bringup.learning.campaigns import PolicyName, campaign_of
from likeme_bringup.learning.keeping import (
    DONE,
    FAILED,
    Store,
    default_place,
    export_command,
    failed,
    import_command,
    open_store,
    summary_command,
)
from likeme_bringup.learning.telling import Telling
from likeme_bringup.one_cell import AlreadyRunningError, claim
from likeme_bringup.start_cell import Domain
from likeme_inference.experience.campaign import Campaign, Progress
from likeme_inference.experience.database import StoreError
from likeme_inference.experience.sighting import CellGoneError, TrialVoidError
from likeme_inference.experience.store import ExperienceStore

app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)
app.command('summary')(summary_command)
app.command('export')(export_command)
app.command('import')(import_command)
console = Console()
NO_CELL, INTERRUPTED = 3, 130


class Failure(NamedTuple):
    """An exit code, and why it is not 0."""

    code: int
    why: str


@app.callback(invoke_without_command=True)
def learn_command(
    context: typer.Context,
    offline: Annotated[
        bool, typer.Option('--offline', help='Without ROS, in cells of its own.')
    ] = False,
    workers: Annotated[
        int | None, typer.Option(min=1, max=1024, help='Processes, offline; all cores.')
    ] = None,
    scheduler: Annotated[
        str | None, typer.Option(help='Address of a Dask scheduler, e.g. tcp://host:8786.')
    ] = None,
    with_cell: Annotated[
        bool, typer.Option('--with-cell', help='Live: start a cell for it, as fast as it goes.')
    ] = False,
    policy: Annotated[
        PolicyName, typer.Option(help='How the next trial is chosen.')
    ] = PolicyName.SYSTEMATIC,
    repetitions: Annotated[int, typer.Option(min=1, help='Trials of each pair.')] = 10,
    trials: Annotated[
        int | None, typer.Option(min=1, help='Trials in all, for random and information-gain.')
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help='Of the campaign.')] = 1,
    objects: Annotated[
        list[str] | None, typer.Option('--object', help='Only this one; may be repeated.')
    ] = None,
    robot: Annotated[
        str | None, typer.Option(help="Live: name of the body; else the simulated one's.")
    ] = None,
    domain: Domain = 0,
    store: Store = None,
) -> None:
    """Try every action on every object from every state, and record what the camera saw of it."""
    if context.invoked_subcommand is not None:
        return
    if not offline and (workers or scheduler):
        raise typer.BadParameter('--workers and --scheduler are for --offline.')
    if offline and (with_cell or robot):
        raise typer.BadParameter('--with-cell and --robot are for the live cell.')
    # Takes a second to import, and who exports or asks for a summary needs none of it.
    from likeme_bringup.learning.trial_cell import simulated_robot

    names = _objects(objects)
    kind, body = 'offline' if offline else 'live', robot or simulated_robot()
    campaign = campaign_of(kind, body, seed, names, policy, repetitions, trials)
    if offline:
        crew_size = workers or len(os.sched_getaffinity(0))
        code = _learn(campaign, store, partial(_offline, crew_size, scheduler))
    else:
        code = _learn(campaign, store, partial(_live, domain, with_cell))
    raise typer.Exit(code)


Learn = Callable[[Progress, ExperienceStore, Telling], Failure]


def _learn(campaign: Campaign, place: str | None, way: Learn) -> int:
    """Make what is missing of a campaign; the exit code."""
    # To be asked to end by a service manager is as good as Ctrl-C.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        with closing(open_store(place)) as store:
            progress = Progress(campaign, store)
            if progress.done != progress.total:
                store.check_writable()
            telling = Telling(progress, console)
            with telling.shown():
                try:
                    code, why = way(progress, store, telling)
                except KeyboardInterrupt:
                    why = 'Stopped. The same command goes on from here.'
                    code = INTERRUPTED
            telling.say(telling.in_the_end(store.place))
    except StoreError as error:
        return failed(str(error))
    return failed(why, code) if why else code


def _offline(
    workers: int, scheduler: str | None, progress: Progress, store: ExperienceStore, tell: Telling
) -> Failure:
    from likeme_bringup.learning import offline
    from likeme_bringup.learning.trial_cell import TrialFailedError

    try:
        if scheduler is None:
            offline.learn_locally(progress, store, workers, tell.trial)
        else:
            with offline.dask_crew(scheduler) as crew:
                offline.learn(progress, store, crew, tell.trial)
    except TrialFailedError as error:
        return Failure(FAILED, f'A trial cannot be made. {error}')
    except BrokenProcessPool:
        return Failure(FAILED, 'Processes that make trials die again and again.')
    except offline.NoClusterError as error:
        return Failure(FAILED, str(error))
    return Failure(DONE, '')


def _live(
    domain: int, with_cell: bool, progress: Progress, store: ExperienceStore, tell: Telling
) -> Failure:
    from likeme_bringup.learning import live_node
    from likeme_bringup.learning.own_cell import CellDiesError, own_cell
    from likeme_bringup.learning.trial_cell import software_version

    try:
        with ExitStack() as stack:
            stack.enter_context(claim(domain, ['explorer']))
            node = stack.enter_context(live_node.explorer(domain))
            log = Path(default_place()).with_name('learn') / 'cell.log'
            cell = stack.enter_context(own_cell(domain, 0, log, tell.say)) if with_cell else None
            learner = live_node.LiveLearner(node, tell, software_version(), cell)
            learner.learn(progress, store)
    except CellGoneError as error:
        return Failure(NO_CELL, str(error))
    except (TrialVoidError, CellDiesError, AlreadyRunningError) as error:
        return Failure(FAILED, str(error))
    return Failure(DONE, '')


def _objects(names: list[str] | None) -> tuple[str, ...]:
    for name in names or ():
        if name not in OBJECTS:
            raise typer.BadParameter(f"expected one of {', '.join(OBJECTS)}, got '{name}'.")
    return tuple(name for name in OBJECTS if not names or name in names)


def run() -> None:
    """Console entry point."""
    app(prog_name='learn')


if __name__ == '__main__':
    run()

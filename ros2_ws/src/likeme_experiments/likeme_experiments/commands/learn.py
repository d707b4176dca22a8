"""The command behind scripts/learn.sh: make the trials of a campaign and record them."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable
from concurrent.futures.process import BrokenProcessPool
from contextlib import ExitStack, closing
from functools import partial
from pathlib import Path
from typing import Annotated, NamedTuple

import typer
from rich.console import Console

from likeme_core.cli import MAX_SEED, WORLD_DEFAULT, Domain, WorldOption
from likeme_core.instance_lock import AlreadyRunningError, claim
from likeme_core.typer_app import App, command_follows
from likeme_core.world import World
from likeme_experiments.commands.learn_store import (
    DONE,
    FAILED,
    Store,
    export_command,
    failed,
    import_command,
    summary_command,
)
from likeme_experiments.learning.campaigns import PolicyName, Resets, campaign_of
from likeme_experiments.learning.reset_prompt import ResetPrompt
from likeme_experiments.learning.store_location import default_place, open_store
from likeme_experiments.learning.trial_observation import CellGoneError, TrialVoidError
from likeme_experiments.learning.trial_reporter import TrialReporter
from likeme_inference.experience.campaign import Campaign, Progress
from likeme_inference.experience.store import ExperienceStore
from likeme_inference.experience.store_error import StoreError
from likeme_inference.keyboard import Keyboard

app = App(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)
app.command('summary')(summary_command)
app.command('export')(export_command)
app.command('import')(import_command)
console = Console()
NO_CELL, INTERRUPTED = 3, 130
#: Parts of a cell that a person sets up: without inference, which would imitate the person.
WATCHED_PARTS = 'hold', 'arm', 'perception'


class ExitStatus(NamedTuple):
    """An exit code, and the reason if it is not 0."""

    code: int
    reason: str = ''


@app.callback(invoke_without_command=True)
def learn_command(
    context: typer.Context,
    offline: Annotated[
        bool,
        typer.Option('--offline', help='Without ROS, in simulated cells in worker processes.'),
    ] = False,
    workers: Annotated[
        int | None,
        typer.Option(
            min=1, max=1024, help='Offline: worker processes. Default: one for each core.'
        ),
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(help='Offline: address of a Dask scheduler, e.g. tcp://host:8786.'),
    ] = None,
    with_cell: Annotated[
        bool,
        typer.Option(
            '--with-cell', help='Live: start a cell first; it runs in real time with people.'
        ),
    ] = False,
    policy: Annotated[
        PolicyName, typer.Option(help='How the next trial is chosen.')
    ] = PolicyName.SYSTEMATIC,
    resets: Annotated[
        Resets,
        typer.Option(
            help='Live: who sets the table up; human: as little as possible, asked for here.'
        ),
    ] = Resets.SIMULATOR,
    repetitions: Annotated[
        int | None,
        typer.Option(
            min=1, help='systematic: trials of each object, state and action. Default: 10.'
        ),
    ] = None,
    trials: Annotated[
        int | None, typer.Option(min=1, help='random, information-gain: trials in all.')
    ] = None,
    seed: Annotated[int, typer.Option(min=0, max=MAX_SEED, help='Seed of the campaign.')] = 1,
    objects: Annotated[
        list[str] | None, typer.Option('--object', help='Only this object; may be repeated.')
    ] = None,
    robot: Annotated[
        str | None, typer.Option(help='Live: name of the robot. Default: the simulated one.')
    ] = None,
    world: WorldOption = WORLD_DEFAULT,
    domain: Domain = 0,
    store: Store = None,
) -> None:
    """Try every action on every object from every state, and record how the camera saw it end."""
    if command_follows(context):
        return
    if not offline and (workers or scheduler):
        raise typer.BadParameter('--workers and --scheduler are for --offline.')
    if offline and (with_cell or robot):
        raise typer.BadParameter('--with-cell and --robot are for the live cell.')
    if policy is PolicyName.SYSTEMATIC and trials is not None:
        raise typer.BadParameter('--trials is for the other policies; systematic: --repetitions.')
    if policy is not PolicyName.SYSTEMATIC and repetitions is not None:
        raise typer.BadParameter(f'--repetitions is for --policy systematic; {policy}: --trials.')
    by_hand = resets is Resets.HUMAN
    if by_hand:
        _check_by_hand(offline, with_cell, robot, policy)
    names = _objects(world, objects)
    kind = 'offline' if offline else 'human' if by_hand else 'live'
    name = robot or _simulated_robot(world)
    campaign = campaign_of(world, kind, name, seed, names, policy, repetitions, trials)
    if offline:
        count = workers or len(os.sched_getaffinity(0))
        code = _learn(campaign, store, partial(_offline, count, scheduler))
    else:
        code = _learn(campaign, store, partial(_live, domain, with_cell, by_hand))
    raise typer.Exit(code)


def _simulated_robot(world: World) -> str:
    # Takes a second to import; a named robot, export and summary do not need it.
    from likeme_experiments.learning.robot_identity import simulated_robot

    return simulated_robot(world)


def _check_by_hand(offline: bool, with_cell: bool, robot: str | None, policy: PolicyName) -> None:
    """Refuse options that do not go with people's resets.

    Raises:
        typer.BadParameter: saying which.
    """
    if offline:
        raise typer.BadParameter('--resets human is for the live cell, not for --offline.')
    if robot is None and not with_cell:
        raise typer.BadParameter(
            'Expected --robot NAME with --resets human, as trials of a real arm must not be '
            "taken for the simulated robot's, got none."
        )
    if policy is PolicyName.INFORMATION_GAIN:
        raise typer.BadParameter(
            '--resets human plans ahead; information-gain chooses each trial after the last.'
        )


Learn = Callable[[Progress, ExperienceStore, TrialReporter], ExitStatus]


def _learn(campaign: Campaign, place: str | None, learn: Learn) -> int:
    """Make what is missing of a campaign; the exit code."""
    # SIGTERM, e.g. of a service manager, is handled as Ctrl-C.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        with closing(open_store(campaign.world, place)) as store:
            progress = Progress(campaign, store)
            if progress.done != progress.total:
                store.check_writable()
            reporter = TrialReporter(progress, console)
            with reporter.shown():
                try:
                    code, reason = learn(progress, store, reporter)
                except KeyboardInterrupt:
                    reason = 'Stopped. The same command continues from here.'
                    code = INTERRUPTED
            reporter.print(reporter.summary(store.place))
    except StoreError as error:
        return failed(str(error))
    return failed(reason, code) if reason else code


def _offline(
    workers: int,
    scheduler: str | None,
    progress: Progress,
    store: ExperienceStore,
    reporter: TrialReporter,
) -> ExitStatus:
    from likeme_experiments.learning import offline
    from likeme_experiments.learning.trial_cell import TrialFailedError

    try:
        if scheduler is None:
            offline.learn_locally(progress, store, workers, reporter.report)
        else:
            with offline.dask_pool(scheduler) as pool:
                offline.learn(progress, store, pool, reporter.report)
    except TrialFailedError as error:
        return ExitStatus(FAILED, f'A trial cannot be made. {error}')
    except BrokenProcessPool:
        return ExitStatus(FAILED, 'Worker processes crashed repeatedly.')
    except offline.NoClusterError as error:
        return ExitStatus(FAILED, str(error))
    return ExitStatus(DONE)


def _live(
    domain: int,
    with_cell: bool,
    by_hand: bool,
    progress: Progress,
    store: ExperienceStore,
    reporter: TrialReporter,
) -> ExitStatus:
    from likeme_core.ros.diagnostics import software_version
    from likeme_experiments.learning.managed_cell import CellCrashedError, managed_cell
    from likeme_experiments.ros.explorer_node import ExplorerNode
    from likeme_experiments.ros.human_reset_learning import HumanResetLearner
    from likeme_experiments.ros.live_learning import LiveLearner, explorer
    from likeme_experiments.ros.table_explorer_node import ImitationActiveError, TableExplorerNode

    world, left = progress.campaign.world, ''
    try:
        with ExitStack() as stack:
            stack.enter_context(claim(domain, ['explorer']))
            log = Path(default_place(world)).with_name('learn') / 'cell.log'
            cell = None
            if with_cell:
                factor, parts = (1, WATCHED_PARTS) if by_hand else (0, ())
                managed = managed_cell(world, domain, factor, log, reporter.print, parts)
                cell = stack.enter_context(managed)
            version = software_version()
            if by_hand:
                table_node = stack.enter_context(explorer(domain, world, TableExplorerNode))
                prompt = ResetPrompt(
                    world, Keyboard(sys.stdin.fileno()), reporter.print, table_node.wait_for
                )
                learner = HumanResetLearner(table_node, reporter, version, cell, prompt)
                stack.callback(lambda: reporter.print(learner.summary()))
                learner.learn(progress, store)
                left = learner.left(progress)
            else:
                node = stack.enter_context(explorer(domain, world, ExplorerNode))
                LiveLearner(node, reporter, version, cell).learn(progress, store)
    except CellGoneError as error:
        return ExitStatus(NO_CELL, str(error))
    except EOFError:
        return ExitStatus(FAILED, 'No more input: the request stays unanswered.')
    except (
        TrialVoidError, CellCrashedError, AlreadyRunningError, ImitationActiveError,
    ) as error:  # fmt: skip
        return ExitStatus(FAILED, str(error))
    return ExitStatus(FAILED if left else DONE, left)


def _objects(world: World, names: list[str] | None) -> tuple[str, ...]:
    known = world.objects
    for name in names or ():
        if name not in known:
            raise typer.BadParameter(f"expected one of {', '.join(known)}, got '{name}'.")
    return tuple(name for name in known if not names or name in names)


def run() -> None:
    """Console entry point."""
    app()


if __name__ == '__main__':
    run()

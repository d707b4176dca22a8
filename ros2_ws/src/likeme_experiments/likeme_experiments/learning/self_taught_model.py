"""The model of the simulated robot's own trials: made offline once, then read from the store."""

from __future__ import annotations

import os
from collections import Counter
from concurrent.futures.process import BrokenProcessPool
from contextlib import closing

from rich.console import Console

from likeme_core.world import World
from likeme_experiments.learning.campaigns import PolicyName, campaign_of
from likeme_experiments.learning.offline import learn_locally
from likeme_experiments.learning.robot_identity import simulated_robot
from likeme_experiments.learning.store_location import open_store
from likeme_experiments.learning.trial_cell import TrialFailedError
from likeme_experiments.learning.trial_reporter import TrialReporter
from likeme_inference.experience.campaign import Campaign, Progress
from likeme_inference.experience.model_from_trials import model_of_rows, rows_of
from likeme_inference.experience.store import EndStateCount, ExperienceStore
from likeme_inference.experience.store_error import StoreError
from likeme_inference.tabletop.robot_model import RobotModel

#: As `learn.sh --offline` does by default.
SEED, REPETITIONS = 1, 10


def self_taught(
    world: World,
    workers: int | None = None,
    seed: int = SEED,
    repetitions: int = REPETITIONS,
    objects: tuple[str, ...] | None = None,
    place: str | None = None,
) -> RobotModel:
    """The model of a systematic campaign's trials; missing trials are made first.

    Args:
        world: of the cell.
        workers: processes; all cores by default.
        seed: of the campaign, see learn.sh.
        repetitions: trials of each pair.
        objects: to try; all of the world by default.
        place: of the experience store; the project's by default.

    Raises:
        ValueError: a trial cannot be made, or the store cannot be used.
        ChildProcessError: worker processes crashed repeatedly.
    """
    policy = PolicyName.SYSTEMATIC
    campaign = campaign_of(
        world, 'offline', simulated_robot(world), seed, objects or world.objects, policy,
        repetitions, None,
    )  # fmt: skip
    try:
        with closing(open_store(world, place)) as store:
            _learn(Progress(campaign, store), store, workers or len(os.sched_getaffinity(0)))
            return model_of_rows('self_taught', rows_of(_tallies(campaign, store), world), world)
    except (StoreError, TrialFailedError) as error:
        raise ValueError(str(error)) from error
    except BrokenProcessPool:
        raise ChildProcessError('Worker processes crashed repeatedly.') from None


def _learn(progress: Progress, store: ExperienceStore, workers: int) -> None:
    if progress.done == progress.total:
        return
    reporter = TrialReporter(progress, Console(stderr=True))
    reporter.print(f'Learning: {progress.total} trials in simulated cells.')
    with reporter.shown():
        learn_locally(progress, store, workers, reporter.report)


def _tallies(campaign: Campaign, store: ExperienceStore) -> list[EndStateCount]:
    """Results of the planned trials; by another policy, more may be recorded under the name."""
    planned = {key.identity for key in campaign.plan()}
    ends = Counter(
        (trial.key.pair, trial.x_f)
        for trial in store.trials(campaign.robot, campaign.name)
        if trial.key.identity in planned
    )
    order = campaign.objects.index
    return [
        EndStateCount(campaign.robot, campaign.name, pair, x_f, ends[pair, x_f])
        for pair, x_f in sorted(ends, key=lambda end: (order(end[0].object), end))
    ]

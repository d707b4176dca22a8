"""Trials without ROS in many processes: on this machine, or on a Dask cluster.

Which trials are made and how each ends follows from the campaign alone; processes only decide how
soon. Every trial is recorded when it is made, by the one process that waits for them all.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
from collections.abc import Callable, Iterator
from concurrent.futures import (
    FIRST_COMPLETED,
    Executor,
    Future,
    ProcessPoolExecutor,
    wait,
)
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from itertools import islice
from typing import Any, NamedTuple, cast

from likeme_core.processes import die_with_parent
from likeme_experiments.learning.trial_cell import make_trial
from likeme_inference.experience.campaign import Progress
from likeme_inference.experience.store import ExperienceStore
from likeme_inference.experience.trial import Trial

#: Trials handed out to each process ahead of time, so that none waits for work.
AHEAD = 3
#: Processes that may die one after another without one trial made between.
DEATHS = 3
#: s to wait for a Dask scheduler and its first worker.
CLUSTER_PATIENCE = 10.0


class NoClusterError(Exception):
    """There is no Dask cluster to work with."""


class Crew(NamedTuple):
    """Who makes the trials: an executor, and how many trials it can make at once."""

    executor: Executor
    size: int


OnTrial = Callable[[Trial], None]


def learn(progress: Progress, store: ExperienceStore, crew: Crew, on_trial: OnTrial) -> None:
    """Make and record every trial of a campaign that is missing.

    Raises:
        TrialFailedError: one cannot be made; what was made is recorded.
        BrokenProcessPool: a process died; what was made is recorded.
        StoreError: a trial cannot be recorded.
    """
    campaign, keys = progress.campaign, progress.missing()
    ahead = 1 if campaign.policy.adaptive else crew.size * AHEAD
    running: set[Future[Trial]] = set()
    try:
        while True:
            for key in islice(keys, ahead - len(running)):
                running.add(crew.executor.submit(make_trial, key, campaign.seed))
            if not running:
                return
            done, running = wait(running, return_when=FIRST_COMPLETED)
            for made in done:
                trial = made.result()
                store.record([trial])
                progress.recorded(trial.key)
                on_trial(trial)
    finally:
        for future in running:
            future.cancel()


@contextmanager
def local_crew(workers: int) -> Iterator[Crew]:
    """Processes of this machine, which end with this one."""
    executor = ProcessPoolExecutor(
        workers, multiprocessing.get_context('spawn'), _begin_worker, (os.getpid(),)
    )
    try:
        yield Crew(executor, workers)
    finally:
        executor.shutdown(cancel_futures=True)


def _begin_worker(parent: int) -> None:
    # Ctrl-C reaches everybody at the terminal; the parent decides what it means.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    die_with_parent(parent)()


@contextmanager
def dask_crew(address: str, patience: float = CLUSTER_PATIENCE) -> Iterator[Crew]:
    """The workers of a Dask cluster, which must have this software in their environment.

    Raises:
        NoClusterError: nobody answers there, or it has no worker.
    """
    # Takes a second to import, and only a cluster needs it.
    from distributed import Client

    client: Any
    try:
        client = cast(Any, Client)(address, timeout=patience)
    except (OSError, ValueError) as error:
        reason = ' '.join(str(error).split())
        raise NoClusterError(f'Expected a Dask scheduler at {address}: {reason}') from None
    with client:
        try:
            client.wait_for_workers(1, timeout=patience)
        except TimeoutError:
            raise NoClusterError(f'The Dask scheduler at {address} has no worker.') from None
        threads = sum(client.nthreads().values())
        # A trial is pure, but worth making once only: its cell is not.
        yield Crew(client.get_executor(pure=False, retries=DEATHS), threads)


def learn_locally(
    progress: Progress, store: ExperienceStore, workers: int, on_trial: OnTrial
) -> None:
    """As `learn` with processes of this machine; one that is killed is replaced.

    Raises:
        BrokenProcessPool: they die again and again.
    """
    deaths = 0
    while True:
        before = progress.done
        try:
            with local_crew(workers) as crew:
                learn(progress, store, crew, on_trial)
            return
        except BrokenProcessPool:
            deaths = 1 if progress.done > before else deaths + 1
            if deaths >= DEATHS:
                raise

"""Trials without ROS in many processes: on this machine, or on a Dask cluster.

Which trials are made and how each ends follows from the campaign alone, whatever the number of
processes. The one process that waits for them all records each trial as soon as it is made.
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

#: Trials queued for each process, so that none waits for work.
PREFETCH = 3
#: Crashes of a worker in a row without a trial between them.
MAX_CRASHES = 3
#: s to wait for a Dask scheduler and its first worker.
CLUSTER_TIMEOUT = 10.0


class NoClusterError(Exception):
    """No Dask scheduler or worker was found."""


class WorkerPool(NamedTuple):
    """An executor, and how many trials it can make at once."""

    executor: Executor
    size: int


OnTrial = Callable[[Trial], None]


def learn(progress: Progress, store: ExperienceStore, pool: WorkerPool, on_trial: OnTrial) -> None:
    """Make and record every trial of a campaign that is missing.

    Raises:
        TrialFailedError: one cannot be made; what was made is recorded.
        BrokenProcessPool: a process died; what was made is recorded.
        StoreError: a trial cannot be recorded.
    """
    campaign, keys = progress.campaign, progress.missing()
    source = campaign.world.source
    queued = 1 if campaign.policy.adaptive else pool.size * PREFETCH
    running: set[Future[Trial]] = set()
    try:
        while True:
            for key in islice(keys, queued - len(running)):
                running.add(pool.executor.submit(make_trial, key, campaign.seed, source))
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
def local_pool(workers: int) -> Iterator[WorkerPool]:
    """Processes of this machine, which end with this one."""
    executor = ProcessPoolExecutor(
        workers, multiprocessing.get_context('spawn'), _begin_worker, (os.getpid(),)
    )
    try:
        yield WorkerPool(executor, workers)
    finally:
        executor.shutdown(cancel_futures=True)


def _begin_worker(parent: int) -> None:
    # Ctrl-C reaches every process of the terminal; the parent alone handles it.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    die_with_parent(parent)()


@contextmanager
def dask_pool(address: str, timeout: float = CLUSTER_TIMEOUT) -> Iterator[WorkerPool]:
    """The workers of a Dask cluster, which must have this software in their environment.

    Raises:
        NoClusterError: no scheduler answers at the address, or it has no worker; or distributed is
            not installed.
    """
    # Takes a second to import, and only a cluster needs it; rosdep does not know it.
    try:
        from distributed import Client
    except ModuleNotFoundError:
        raise NoClusterError(
            'Expected the Python package distributed for --scheduler: '
            'install it from pip (python3 -m pip install distributed).'
        ) from None

    client: Any
    try:
        client = cast(Any, Client)(address, timeout=timeout)
    except (OSError, ValueError) as error:
        reason = ' '.join(str(error).split())
        raise NoClusterError(f'Expected a Dask scheduler at {address}: {reason}') from None
    with client:
        try:
            client.wait_for_workers(1, timeout=timeout)
        except TimeoutError:
            raise NoClusterError(f'The Dask scheduler at {address} has no worker.') from None
        threads = sum(client.nthreads().values())
        # pure=False: Dask must not merge equal calls, since each worker keeps cells between them.
        yield WorkerPool(client.get_executor(pure=False, retries=MAX_CRASHES), threads)


def learn_locally(
    progress: Progress, store: ExperienceStore, workers: int, on_trial: OnTrial
) -> None:
    """As `learn` with processes of this machine; one that is killed is replaced.

    Raises:
        BrokenProcessPool: workers crashed MAX_CRASHES times without a trial between.
    """
    crashes = 0
    while True:
        before = progress.done
        try:
            with local_pool(workers) as pool:
                learn(progress, store, pool, on_trial)
            return
        except BrokenProcessPool:
            crashes = 1 if progress.done > before else crashes + 1
            if crashes >= MAX_CRASHES:
                raise

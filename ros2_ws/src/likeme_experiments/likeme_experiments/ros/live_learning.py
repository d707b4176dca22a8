"""A campaign in the running cell: one trial after another, each repeated until it is valid."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TypeVar

from rclpy.context import Context

from likeme_core.interrupt import deferred_interrupt
from likeme_core.world import World
from likeme_experiments.learning.managed_cell import ManagedCell
from likeme_experiments.learning.trial_observation import CellGoneError, TrialVoidError
from likeme_experiments.learning.trial_reporter import TrialReporter
from likeme_experiments.ros.explorer_node import ExplorerNode
from likeme_inference.experience.campaign import Progress
from likeme_inference.experience.store import ExperienceStore
from likeme_inference.experience.trial import Trial, TrialKey

Explorer = TypeVar('Explorer', bound=ExplorerNode)
#: s to wait for a running cell at first, and for one that is being started or restarted.
FIRST_TIMEOUT, RESTART_TIMEOUT = 8.0, 60.0
#: s between two checks whether the managed cell still runs.
POLL_PERIOD = 2.0
#: Void trials in a row before the campaign is given up.
MAX_VOID = 8


class LiveLearner:
    """Makes and records what is missing of a campaign, in the cell of one ROS domain."""

    def __init__(
        self, node: ExplorerNode, reporter: TrialReporter, version: str, cell: ManagedCell | None
    ) -> None:
        """cell: restarted when it ends; None: the cell is not this process's."""
        self._node, self._reporter, self._version, self._cell = node, reporter, version, cell
        self._timeout = FIRST_TIMEOUT if cell is None else RESTART_TIMEOUT

    def learn(self, progress: Progress, store: ExperienceStore) -> None:
        """Make and record every trial that is missing.

        Raises:
            CellGoneError: there is no cell, or it did not come back.
            CellCrashedError: a managed cell ended again and again.
            TrialVoidError: a trial was void MAX_VOID times.
            StoreError: a trial cannot be recorded.
        """
        for key in progress.missing():
            trial = self._trial(key, progress.campaign.seed)
            store.record([trial])
            progress.recorded(key)
            self._reporter.report(trial)
            if self._cell is not None:
                self._cell.trial_recorded()

    def _trial(self, key: TrialKey, campaign_seed: int) -> Trial:
        void = 0
        while True:
            self._wait_for_cell()
            try:
                return self._node.make_trial(key, key.seed(campaign_seed, void), self._version)
            except TrialVoidError as error:
                void += 1
                if void == MAX_VOID:
                    raise
                self._reporter.print(f'Repeating a trial. {error}')
            except CellGoneError as error:
                self._reporter.print(f'{error} Waiting for the cell.')

    def _wait_for_cell(self) -> None:
        deadline = time.monotonic() + self._timeout
        while True:
            if self._cell is not None and self._cell.ensure_running():
                deadline = time.monotonic() + self._timeout
            try:
                self._node.wait_for_cell(POLL_PERIOD)
            except CellGoneError:
                if time.monotonic() > deadline:
                    raise
            else:
                self._timeout = RESTART_TIMEOUT
                return


@contextmanager
def explorer(domain: int, world: World, kind: type[Explorer]) -> Iterator[Explorer]:
    """An explorer on a ROS domain; Ctrl-C raises KeyboardInterrupt between two spins."""
    context = Context()
    context.init(domain_id=domain)
    with deferred_interrupt() as check:
        node = kind(world, context, check)
        try:
            yield node
        finally:
            node.close()
            context.try_shutdown()

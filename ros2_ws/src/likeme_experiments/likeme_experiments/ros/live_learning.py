"""A campaign in the running cell: one trial after another, each made until it counts."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager

from rclpy.context import Context

from likeme_core.interrupt import noted_interrupt
from likeme_experiments.learning.managed_cell import OwnCell
from likeme_experiments.learning.progress_display import Telling
from likeme_experiments.ros.explorer_node import ExplorerNode
from likeme_inference.experience.campaign import Progress
from likeme_inference.experience.sighting import CellGoneError, TrialVoidError
from likeme_inference.experience.store import ExperienceStore
from likeme_inference.experience.trial import Trial, TrialKey

#: s to wait for a cell at the start, and for one that is started or died to come (back).
AT_FIRST, TO_RETURN = 8.0, 60.0
#: s between two looks whether an own cell still runs while it is waited for.
GLANCE = 2.0
#: Trials that may be void one after another.
VOID = 8


class LiveLearner:
    """Makes and records what is missing of a campaign, in the cell of one ROS domain."""

    def __init__(
        self, node: ExplorerNode, telling: Telling, version: str, cell: OwnCell | None
    ) -> None:
        """cell: to be started anew when it dies; None: somebody else's."""
        self._node, self._telling, self._version, self._cell = node, telling, version, cell
        self._patience = AT_FIRST if cell is None else TO_RETURN

    def learn(self, progress: Progress, store: ExperienceStore) -> None:
        """Make and record every trial that is missing.

        Raises:
            CellGoneError: there is no cell, or it did not come back.
            CellDiesError: an own cell ended again and again.
            TrialVoidError: a trial was void again and again.
            StoreError: a trial cannot be recorded.
        """
        for key in progress.missing():
            trial = self._trial(key, progress.campaign.seed)
            store.record([trial])
            progress.recorded(key)
            self._telling.trial(trial)
            if self._cell is not None:
                self._cell.worked()

    def _trial(self, key: TrialKey, campaign_seed: int) -> Trial:
        void = 0
        while True:
            self._wait_for_cell()
            try:
                return self._node.make_trial(key, key.seed(campaign_seed, void), self._version)
            except TrialVoidError as error:
                void += 1
                if void == VOID:
                    raise
                self._telling.say(f'A trial is made anew. {error}')
            except CellGoneError as error:
                self._telling.say(f'{error} Waiting for the cell.')

    def _wait_for_cell(self) -> None:
        deadline = time.monotonic() + self._patience
        while True:
            if self._cell is not None and self._cell.ensure():
                deadline = time.monotonic() + self._patience
            try:
                self._node.wait_for_cell(GLANCE)
            except CellGoneError:
                if time.monotonic() > deadline:
                    raise
            else:
                self._patience = TO_RETURN
                return


@contextmanager
def explorer(domain: int) -> Iterator[ExplorerNode]:
    """An explorer on a ROS domain; Ctrl-C raises KeyboardInterrupt between two spins."""
    context = Context()
    context.init(domain_id=domain)
    with noted_interrupt() as check:
        node = ExplorerNode(context, check)
        try:
            yield node
        finally:
            node.close()
            context.try_shutdown()

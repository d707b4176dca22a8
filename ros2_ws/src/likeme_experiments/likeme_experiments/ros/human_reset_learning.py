"""A campaign on a table that people set up, in the order in which they are asked least."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable

import numpy as np

from likeme_core.tabletop import State
from likeme_experiments.learning.managed_cell import ManagedCell
from likeme_experiments.learning.reset_prompt import ResetAnswer, ResetDesk
from likeme_experiments.learning.trial_observation import (
    CellGoneError,
    NotFreeError,
    ObservedTable,
    TrialVoidError,
)
from likeme_experiments.learning.trial_reporter import TrialReporter
from likeme_experiments.ros.live_learning import MAX_VOID, LiveLearner
from likeme_experiments.ros.table_explorer_node import TableExplorerNode
from likeme_inference.experience.campaign import Progress
from likeme_inference.experience.reset_planning import (
    Reset,
    ResetStep,
    TrialStep,
    TrialsWanted,
    next_step,
)
from likeme_inference.experience.store import ExperienceStore
from likeme_inference.experience.trial import Pair, Trial

#: Times that a reset is skipped before it is asked for no more in this run.
MAX_SKIPS = 3
#: m. An object that moved less is where it was.
MOVED = 0.02


class HumanResetLearner(LiveLearner):
    """Makes and records what is missing of a campaign; its state is the table and the store.

    Attributes:
        asked: for each request to people, its resets that the camera saw.
        recorded, transports: trials, and those of them that were not wanted.
    """

    def __init__(
        self,
        node: TableExplorerNode,
        reporter: TrialReporter,
        version: str,
        cell: ManagedCell | None,
        desk: ResetDesk,
    ) -> None:
        """See LiveLearner."""
        super().__init__(node, reporter, version, cell)
        self._table_node, self._desk = node, desk
        self.asked: list[int] = []
        self.recorded = self.transports = 0
        self._blocked: dict[Pair, str] = {}
        self._in_vain: set[Pair] = set()
        self._skipped: Counter[Reset] = Counter()
        self._later: set[Reset] = set()

    def learn(self, progress: Progress, store: ExperienceStore) -> None:
        """Make and record every trial that is missing, but for those whose resets were skipped.

        Raises:
            EOFError: the answers ended.
            ImitationActiveError: an inference node is active.
            and as LiveLearner.learn.
        """
        void, going_on = 0, True
        while going_on:
            self._wait_for_cell()
            try:
                going_on = self._step(progress, store)
                void = 0
            except TrialVoidError as error:
                void += 1
                if void == MAX_VOID:
                    raise
                self._reporter.print(f'No trial. {error}')
            except CellGoneError as error:
                self._reporter.print(f'{error} Waiting for the cell.')

    def summary(self) -> str:
        """How often people were asked in this run."""
        resets, requests, trials = sum(self.asked), len(self.asked), self.recorded
        share = (
            f', {100 * resets / trials:.0f} and {100 * requests / trials:.0f} per 100 trials'
            if trials
            else ''
        )
        return (
            f'People made {resets} resets in {requests} requests{share}; {self.transports} of '
            f'{trials} trials were beyond the plan, to bring objects to where trials were wanted.'
        )

    def left(self, progress: Progress) -> str:
        """What is not recorded, as its resets were skipped; empty: nothing."""
        wanted = progress.wanted()
        states = progress.campaign.world.states
        parts = [
            f'{name} from {state.name} ({n})'
            for name, missing in wanted.items()
            for state, n in zip(states, missing.sum(axis=-1), strict=True)
            if n
        ]
        total = sum(int(missing.sum()) for missing in wanted.values())
        return (
            f'{total} trials are left, as their resets were skipped: {", ".join(parts)}. The '
            'same command asks again.'
            if total
            else ''
        )

    def _step(self, progress: Progress, store: ExperienceStore) -> bool:
        """Make one trial or one request; False: there is nothing more to do."""
        campaign = progress.campaign
        wanted = progress.wanted()
        if not any(missing.any() for missing in wanted.values()):
            return False
        table = self._table_node.observe()
        counts = store.counts(campaign.objects, [campaign.robot])
        made = sum(int(each.sum()) for each in counts.values())
        given_up = {reset for reset, times in self._skipped.items() if times >= MAX_SKIPS}
        step = next_step(
            campaign.world,
            TrialsWanted(
                wanted, _states(table, campaign.objects), counts, frozenset(self._blocked),
                frozenset(self._in_vain), frozenset(self._later | given_up),
            ),
            np.random.default_rng([campaign.seed, made]),
        )  # fmt: skip
        if isinstance(step, TrialStep):
            self._try(step, table, progress, store)
        elif isinstance(step, ResetStep):
            self._ask(step, table)
        return step is not None

    def _try(
        self, step: TrialStep, table: ObservedTable, progress: Progress, store: ExperienceStore
    ) -> None:
        key = progress.next_key(step.pair)
        try:
            trial = self._table_node.try_action(key, table, self._version)
        except NotFreeError as error:
            self._blocked[step.pair] = str(error)
            return
        store.record([trial])
        progress.recorded(key)
        self.recorded += 1
        self.transports += not step.wanted
        self._reporter.report(trial, planned=step.wanted)
        if step.pair.x_i not in progress.campaign.world.out_of_reach:
            if stayed(trial):
                self._in_vain.add(step.pair)
            else:
                self._moved(step.pair.object)
                self._blocked.clear()
        self._later.clear()
        if self._cell is not None:
            self._cell.trial_recorded()

    def _ask(self, step: ResetStep, before: ObservedTable) -> None:
        names = [reset.object for reset in step.resets]
        reasons = [reason for pair, reason in self._blocked.items() if pair.object in names]
        self.asked.append(0)
        with self._reporter.paused():
            answer = self._desk.ask(step.resets, reasons)
        if answer is ResetAnswer.SKIP:
            self._skip(step.resets)
            return
        self._blocked.clear()
        after = self._table_node.observe()
        for reset in step.resets:
            self._moved(reset.object)
            old, new = (table.objects[reset.object].state for table in (before, after))
            self.asked[-1] += new is not None and (new == reset.state or new != old)
            if new != reset.state:
                self._reporter.print(_not_there(reset, new))

    def _moved(self, name: str) -> None:
        self._in_vain = {pair for pair in self._in_vain if pair.object != name}

    def _skip(self, resets: Iterable[Reset]) -> None:
        for reset in resets:
            self._later.add(reset)
            self._skipped[reset] += 1
            if self._skipped[reset] == MAX_SKIPS:
                self._reporter.print(
                    f'The {reset.object} {reset.state.name} was skipped {MAX_SKIPS} times: it is '
                    'asked for no more in this run.'
                )


def stayed(trial: Trial) -> bool:
    """Whether a trial left its object where it was: within MOVED, in the same state."""
    before, after = trial.before, trial.after
    if before is None or after is None or trial.x_f != trial.key.pair.x_i:
        return False
    return math.hypot(after.x - before.x, after.y - before.y) < MOVED


def _not_there(reset: Reset, seen: State | None) -> str:
    if seen is None:
        return f'The camera does not see where the {reset.object} is.'
    return f'The camera sees the {reset.object} {seen.name}, not {reset.state.name}.'


def _states(table: ObservedTable, names: Iterable[str]) -> dict[str, State | None]:
    """The state of each object; None: not known, or never seen.

    Raises:
        TrialVoidError: perception does not know one of them.
    """
    for name in names:
        if name not in table.objects:
            known = ', '.join(sorted(table.objects))
            raise TrialVoidError(f'The camera knows {known}, not {name}.')
    objects = {name: table.objects[name] for name in names}
    return {name: each.state if each.ever_seen else None for name, each in objects.items()}

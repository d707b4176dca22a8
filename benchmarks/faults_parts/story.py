"""One story in simulated time: a person shows, the robot imitates or asks, with one fault."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from faults_parts.fault_kinds import ASKED, FIRST, KINDS, LAST, MOVED, Fault
from faults_parts.sim_cell import Cell
from faults_parts.sim_operator import Manner
from faults_parts.sim_time import SIM_TIME

#: Kinds of a decision and replies.
EXECUTE, ASK_HUMAN, AT_GOAL, NO_ACTION = range(4)
DONE_BY_HAND, TRY_ANYWAY = 0, 1
#: A result and a motion's outcome after which a mode that asks decides anew.
GOAL_NAMED, NOT_FREE = 5, 14
#: Share of actions that are not free until the way is cleared.
BLOCKED = 0.2
#: s of simulated time.
BELIEF_TIME, DECISION_TIME, OUTCOME_TIME, SETTLE_TIME = 2.0, 4.0, 120.0, 60.0
ATTEMPTS = 8


class Story(NamedTuple):
    """How a story went.

    Attributes:
        finished: whether a decision was made and has its outcome, and all is ready again.
        seconds: from the fault to the outcome, simulated.
        reason: why it was not finished.
    """

    finished: bool
    seconds: float
    reason: str = ''


class Trigger:
    """Has a fault come at its moment. came: when, steady s; None: not yet."""

    def __init__(self, cell: Cell, fault: Fault) -> None:
        self._cell, self._fault, self._left = cell, fault, fault.skip
        self._moment = fault.moment
        self.came: float | None = None
        cell.graph.watchers.append(self._happens)

    def come(self) -> None:
        """Have the fault come now, unless it has come."""
        if self.came is None:
            self._cell.graph.watchers.remove(self._happens)
            self.came = SIM_TIME.seconds
            KINDS[self._fault.kind](self._cell, self._fault)

    def _happens(self, event: str) -> None:
        if event == 'publish decision':
            self._moment = self._possible(self._moment)
        if event != self._moment:
            return
        if self._left:
            self._left -= 1
            return
        self.come()

    def _possible(self, moment: str) -> str:
        """A moment that comes after the decision that was made, for one that does not."""
        decision = self._cell.decision
        if decision is None or decision.kind not in (EXECUTE, ASK_HUMAN):
            return moment
        moves = decision.kind == EXECUTE or self._cell.operator.manner.reply == TRY_ANYWAY
        later = (*(MOVED if moves else ()), *(ASKED if decision.kind == ASK_HUMAN else ()), *LAST)
        never = set(FIRST + ASKED + MOVED) - set(later) - {'publish decision'}
        return later[decision.id % len(later)] if moment in never else moment


def play(cell: Cell, fault: Fault, rng: np.random.Generator) -> Story:
    """Play a story to its end, and until everything works again."""
    world, table = cell.world, cell.table
    cell.operator.manner = Manner(reply=int(rng.integers(0, 4)))
    table.blocked = {action.name for action in world.actions if rng.random() < BLOCKED}
    cell.operator.clear_the_way = table.blocked.clear
    reachable = [s for s in world.states if s not in world.out_of_reach]
    name = str(rng.choice(world.objects))
    x_i, x_f = (int(s) for s in rng.permutation(len(reachable))[:2])
    for each in world.objects:
        table.states[each] = int(rng.integers(len(reachable)))
    table.states[name] = x_i
    cell.graph.run(0.5)
    trigger = Trigger(cell, fault)
    decided = _until_decided(cell, name, x_i, x_f, bool(rng.integers(2)))
    closed = decided and _until_closed(cell)
    seconds = SIM_TIME.seconds
    # In a story without its moment, the fault comes when nothing is under way.
    trigger.come()
    ready = cell.graph.run(SETTLE_TIME, lambda: _settled(cell))
    came = trigger.came or seconds
    reasons = [
        sentence
        for sentence, right in (
            ('no decision was made', decided), ('no outcome came', closed),
            ('not everything works again', ready),
        )
        if not right
    ]  # fmt: skip
    return Story(not reasons, max(0.0, seconds - came), ', '.join(reasons[:1]))


def _until_decided(cell: Cell, name: str, x_i: int, x_f: int, shown: bool) -> bool:
    """Show until the robot decides to act, or that it cannot."""
    last = 0 if cell.decision is None else cell.decision.id

    def decided() -> bool:
        latest = cell.decision
        return latest is not None and latest.id > last and latest.kind != AT_GOAL

    for _ in range(ATTEMPTS):
        cell.belief = None
        cell.table.move(name, x_f)
        cell.graph.run(BELIEF_TIME, lambda: decided() or cell.belief is not None)
        if decided():
            return True
        cell.graph.run(0.3)
        cell.table.move(name, x_i, shown)
        if cell.graph.run(DECISION_TIME, decided):
            return True
    return decided()


def _decides_anew(cell: Cell) -> bool:
    latest = next(reversed(cell.monitor.seen.outcomes.values()), None)
    return latest is not None and (
        latest.result == GOAL_NAMED or latest.motion_outcome == NOT_FREE
    )


def _until_closed(cell: Cell) -> bool:
    """Answer, help and wait until no decision waits for its outcome."""
    moved = 0

    def closed() -> bool:
        nonlocal moved
        waiting = cell.open
        if waiting is None or waiting.kind != ASK_HUMAN:
            return waiting is None
        by_hand = cell.monitor.seen.answers.get(waiting.id) == DONE_BY_HAND
        if by_hand and waiting.id != moved:
            # What was said to be done is done now.
            moved = waiting.id
            cell.table.move(waiting.object, waiting.goal)
        return False

    deadline = SIM_TIME.seconds + OUTCOME_TIME
    while SIM_TIME.seconds < deadline:
        if not cell.graph.run(deadline - SIM_TIME.seconds, closed):
            return False
        # In sequential mode a miss is followed by a decision, and in any that asks other outcomes.
        cell.graph.run(
            DECISION_TIME if _decides_anew(cell) else 0.5, lambda: cell.open is not None
        )
        if cell.open is None:
            return True
    return False


def _settled(cell: Cell) -> bool:
    """Whether no fault is left."""
    return cell.ready and not (
        cell.graph.routes
        or cell.stores.problem
        or cell.monitor.seen.hold.held
        or any(process.paused or process.delay for process in cell.processes.values())
    )

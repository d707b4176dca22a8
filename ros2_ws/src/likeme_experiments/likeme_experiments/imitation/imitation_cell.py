"""Where the robot imitates: the object is put back, actions are carried out, the camera watches.

All modes of an episode begin on the same table with the same chance, so what they have in common
is carried out once: the cell's way from the beginning hangs on the actions alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

from likeme_arm_sim.cell import Cell
from likeme_core.observations import TableSnapshot
from likeme_core.outcomes import Actor, MotionOutcome
from likeme_core.tabletop import Action, Manner, State
from likeme_experiments.imitation.demonstration import (
    background_of,
    by_hand,
    eyes_on,
    lone_cell,
    new_cell,
)
from likeme_experiments.learning.observed_cell import SHORTEST, Eyes
from likeme_inference.tabletop.values import MotionReport

Actions = tuple[Action, ...]


class Done(NamedTuple):
    """After an action: what the arm says, and what the camera sees when all is at rest."""

    report: MotionReport
    view: TableSnapshot


class Stage:
    """One object put back by one seed; answers for any series of actions from there."""

    def __init__(self, name: str, x_i: State, seed: int) -> None:
        self._name, self._x_i, self._seed = name, x_i, seed
        self._robots = _robots_cell(name)
        self._eyes: Eyes | None = None
        self._made: Actions = ()
        self._known: dict[Actions, Done] = {}
        self._helped: dict[tuple[Actions, State], TableSnapshot] = {}
        self.beginning = self._begin_anew()
        #: Actions that were really carried out.
        self.carried_out = 0

    def act(self, before: Actions, action: Action) -> Done:
        """The robot's `action` after those `before`."""
        wanted = (*before, action)
        if wanted not in self._known:
            self._go_to(before)
            self._known[wanted] = self._carry_out(self._robots.cell, action)
            self._made = wanted
        return self._known[wanted]

    def help(self, before: Actions, goal: State) -> TableSnapshot:
        """A person places the object where it is wanted, after the robot's actions `before`."""
        if (before, goal) not in self._helped:
            with lone_cell(self._name) as cell:
                self._begin(cell)
                for action in before:
                    self._carry_out(cell, action)
                assert self._eyes is not None, 'It has begun.'
                by_hand(cell, self._eyes, self._name, Action.of(Manner.PLACE, goal))
                self._helped[before, goal] = self._eyes.at_rest().snapshot
            # What this stage saw last was another cell.
            self._eyes = None
        return self._helped[before, goal]

    def _go_to(self, wanted: Actions) -> None:
        """Bring the robot's cell to where those actions lead."""
        mine = self._robots.stage is self and self._eyes is not None
        if mine and self._made == wanted:
            return
        self._begin_anew()
        for action in wanted:
            self._carry_out(self._robots.cell, action)

    def _begin_anew(self) -> TableSnapshot:
        self._robots.stage = self
        return self._begin(self._robots.cell)

    def _begin(self, cell: Cell) -> TableSnapshot:
        cell.restart(self._seed)
        cell.reset([self._name], [self._x_i], self._seed)
        self._eyes, self._made = eyes_on(cell, background_of(self._name)), ()
        return self._eyes.at_rest().snapshot

    def _carry_out(self, cell: Cell, action: Action) -> Done:
        assert self._eyes is not None, 'It has begun.'
        self.carried_out += 1
        look = self._eyes.look
        ended = cell.run_action(Actor.ROBOT, self._name, action, look)
        finished = 0 if ended.finished is None else round(ended.finished * 1e9)
        report = MotionReport(MotionOutcome(int(ended.outcome)), ended.message, finished)
        # The frame that bears witness is one from after the motion.
        cell.step(SHORTEST)
        return Done(report, self._eyes.at_rest().snapshot)


@dataclass
class _RobotsCell:
    """A cell in which no person ever acts: what follows a restart is the same to the last bit.

    stage: whose actions it carried out last.
    """

    cell: Cell
    stage: Stage | None = None


@cache
def _robots_cell(name: str) -> _RobotsCell:
    return _RobotsCell(new_cell(name))

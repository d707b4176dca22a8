"""The cell in which the robot imitates: from one start table, the result of any action sequence.

All modes of an episode start from the same table with the same seed, and what follows depends on
the actions alone. Each action sequence is therefore executed once and its result kept.
"""

from __future__ import annotations

from typing import NamedTuple

from likeme_arm_sim.cell import Cell
from likeme_core.observations import TableSnapshot
from likeme_core.outcomes import Actor, MotionOutcome
from likeme_core.tabletop import Action, State
from likeme_core.world import World
from likeme_experiments.imitation.demonstration import (
    background_of,
    human_action,
    new_perception,
    set_up,
    temporary_cell,
)
from likeme_experiments.learning.cell_perception import FRAME_PERIOD, CellPerception
from likeme_inference.tabletop.values import MotionReport

Actions = tuple[Action, ...]


class ActionResult(NamedTuple):
    """After an action: the arm's report, and the table once it has settled."""

    report: MotionReport
    view: TableSnapshot


class ImitationCell:
    """One object in one start state; executes actions in a cell that the caller owns.

    The cell may have other objects, of which the robot stays clear.

    Attributes:
        start: the settled table before any action.
        executed: how many actions were executed.
    """

    def __init__(self, world: World, cell: Cell, name: str, x_i: State, seed: int) -> None:
        """cell: with this object, without human actions; nothing else may use it meanwhile."""
        self._world, self._cell, self._name = world, cell, name
        self._x_i, self._seed = x_i, seed
        self._done: Actions = ()
        self._results: dict[Actions, ActionResult] = {}
        self._helped: dict[tuple[Actions, State], TableSnapshot] = {}
        self.executed = 0
        self.start = self._restart()

    def execute(self, before: Actions, action: Action) -> ActionResult:
        """The result of `action` after the actions `before`."""
        sequence = (*before, action)
        if sequence not in self._results:
            self._go_to(before)
            self._results[sequence] = self._execute(self._cell, self._perception, action)
            self._done = sequence
        return self._results[sequence]

    def help(self, before: Actions, goal: State) -> TableSnapshot:
        """The table after the actions `before` and a human who places the object at the goal."""
        if (before, goal) not in self._helped:
            together = len(self._cell.world.objects) > 1
            with temporary_cell(self._world, self._name, together) as cell:
                perception = self._reset(cell)
                perception.wait_until_settled()
                for action in before:
                    self._execute(cell, perception, action)
                human_action(cell, perception, self._name, self._world.action_to(goal))
                self._helped[before, goal] = perception.wait_until_settled().snapshot
        return self._helped[before, goal]

    def _go_to(self, actions: Actions) -> None:
        """Bring the cell to the table after these actions."""
        if self._done == actions:
            return
        self._restart()
        for action in actions:
            self._execute(self._cell, self._perception, action)

    def _restart(self) -> TableSnapshot:
        self._perception, self._done = self._reset(self._cell), ()
        return self._perception.wait_until_settled().snapshot

    def _reset(self, cell: Cell) -> CellPerception:
        set_up(cell, self._name, self._x_i, self._seed)
        return new_perception(self._world, cell, background_of(self._world, self._name))

    def _execute(self, cell: Cell, perception: CellPerception, action: Action) -> ActionResult:
        self.executed += 1
        ended = cell.run_action(
            Actor.ROBOT, self._name, action, perception.look, others=perception.others
        )
        finished = 0 if ended.finished is None else round(ended.finished * 1e9)
        report = MotionReport(MotionOutcome(int(ended.outcome)), ended.message, finished)
        # The result is read from a frame that is newer than the motion.
        cell.step(FRAME_PERIOD)
        return ActionResult(report, perception.wait_until_settled().snapshot)

"""Makes trials on a table that people set up: nothing is reset but by them."""

from __future__ import annotations

import math
import time
from collections.abc import Callable

from rclpy.context import Context

from likeme_core.heartbeats import NodeState
from likeme_core.ros.heartbeat import HeartbeatSubscriber
from likeme_core.stamps import SECOND
from likeme_core.world import World
from likeme_experiments.learning.trial_observation import (
    ObservedTable,
    TrialVoidError,
    state_and_place,
)
from likeme_experiments.ros.explorer_node import SETTLED_TIMEOUT, STALE, ExplorerNode
from likeme_inference.experience.trial import Trial, TrialKey

#: Node that would take a person's resets for demonstrations, and act.
IMITATES = 'inference_node'
#: s since its last heartbeat in which it counts as running.
HEARD = 1.0


class ImitationActiveError(Exception):
    """An inference node is active, which would imitate the people who set the table up."""


class TableExplorerNode(ExplorerNode):
    """Sees the table as it is, and has the arm act on it.

    Subscribes: table_state, joint_states (see ExplorerNode), heartbeat (Heartbeat): whether an
    inference node is active.
    Calls: arm/execute_action.
    """

    def __init__(
        self,
        world: World,
        context: Context | None = None,
        between_spins: Callable[[], None] = lambda: None,
    ) -> None:
        """See ExplorerNode."""
        super().__init__(world, context, between_spins)
        self._heartbeats = HeartbeatSubscriber(self).monitor

    def observe(self) -> ObservedTable:
        """The table as it is now, settled.

        Raises:
            TrialVoidError: it did not settle, or a node of the cell was restarted.
            CellGoneError: camera or perception is gone.
            ImitationActiveError: an inference node is active.
        """
        self._known_publishers = self._current_publishers()
        table = self._settled_table(self._now() + round(STALE * SECOND))
        self._check_imitation()
        return table

    def try_action(self, key: TrialKey, table: ObservedTable, version: str) -> Trial:
        """Make a trial from the table that was observed.

        Raises:
            NotFreeError: other objects are in the way.
            TrialVoidError: it does not count.
            CellGoneError: arm, camera or perception is gone.
            ImitationActiveError: an inference node is active.
        """
        name, x_i, _ = key.pair
        state, before = state_and_place(table, name)
        if state != x_i:
            raise TrialVoidError(f'Expected to see the {name} {x_i.name}, got {state.name}.')
        trial = self._act(key, before, 0, version)
        self._check_imitation()
        return trial

    def wait_for(self, condition: Callable[[], bool]) -> None:
        """Wait as long as it takes, e.g. for a person.

        Raises:
            TrialVoidError: a node of the cell was restarted.
            CellGoneError: camera or perception is gone.
        """
        self._until(condition, math.inf, '')

    def _settled_table(self, not_before: int) -> ObservedTable:
        def settled() -> ObservedTable | None:
            table = self._latest()
            return table if table.stamp >= not_before and table.settled else None

        return self._until(settled, SETTLED_TIMEOUT, 'The camera saw no settled table')

    def _check_imitation(self) -> None:
        for name, node in self._heartbeats.nodes.items():
            active = node.state in (NodeState.READY, NodeState.DEGRADED)
            if name.endswith(IMITATES) and active and time.monotonic() - node.heard < HEARD:
                raise ImitationActiveError(
                    f'Expected no active {IMITATES}, as it imitates people who move objects, got '
                    f'{name}: start the cell with --only hold --only arm --only perception.'
                )

"""The explorer: makes trials in the running cell, one after another, through its services."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any, TypeVar

from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from sensor_msgs.msg import JointState

from likeme_core.outcomes import MotionOutcome
from likeme_core.ros.time import stamp_ns
from likeme_core.tabletop import State
from likeme_experiments.learning.trial_observation import (
    CellGoneError,
    ObservedObject,
    ObservedTable,
    TrialVoidError,
    require_counted_motion,
    state_and_place,
)
from likeme_inference import messages
from likeme_inference.experience.trial import Place, Trial, TrialKey
from likeme_inference.session_inputs import read_motion
from likeme_msgs.msg import ObjectState, TableState
from likeme_msgs.srv import ExecuteAction, ResetCell

T = TypeVar('T')
SECOND = 1_000_000_000
#: s without a table state after which camera or perception count as gone.
SILENCE = 4.0
#: s between two looks at who is in the graph.
GLANCE = 0.5
#: s to wait for answers: of a reset, which waits for no motion, and of a motion.
RESET_TIMEOUT, RESET_PAUSE, MOTION_TIMEOUT = 10.0, 0.5, 120.0
#: s to wait for a motion that somebody else began.
BUSY_PATIENCE = 90.0
#: s of stamps: frames from before a reset are not older than this; in which everything comes to
#: rest; in which the arm may still begin.
STALE, REST_TIMEOUT, EXPIRY = 0.5, 10.0, 5.0
#: s in which the camera must see a table at rest, whatever the stamps say.
SIGHT_TIMEOUT = 60.0


class ExplorerNode(Node):
    """Makes trials: resets the table, has the arm act, reads x_i and x_f from the camera.

    Subscribes: table_state (TableState): what the camera saw, before and after.
    Calls: cell/reset (ResetCell), arm/execute_action (ExecuteAction).
    Also watches who publishes table_state and joint_states: when one of them is another process
    than it was when the trial began, the trial is void.
    """

    def __init__(
        self, context: Context | None = None, between_spins: Callable[[], None] = lambda: None
    ) -> None:
        """between_spins: called again and again while it waits; may raise."""
        super().__init__('explorer', context=context, start_parameter_services=False)
        self._between_spins = between_spins
        self._executor = SingleThreadedExecutor(context=context)
        self._executor.add_node(self)
        self._table: ObservedTable | None = None
        self._heard = time.monotonic()
        self._glanced, self._cast = 0.0, frozenset[bytes]()
        self.create_subscription(TableState, 'table_state', self._on_table, 1)
        # Only so that its publisher is known here as soon as it is there.
        self.create_subscription(JointState, 'joint_states', lambda _: None, 1)
        self._reset_client = self.create_client(ResetCell, 'cell/reset')
        self._arm = self.create_client(ExecuteAction, 'arm/execute_action')

    def wait_for_cell(self, patience: float) -> None:
        """Return when the cell is there and the camera sees something.

        Raises:
            CellGoneError: that took longer than `patience` s.
        """
        self._table, deadline = None, time.monotonic() + patience
        while not (self._table and self._arm.service_is_ready()):
            if time.monotonic() > deadline:
                domain = self.context.get_domain_id()
                raise CellGoneError(
                    f'No cell is running on ROS domain {domain}: start one with '
                    'scripts/start_cell.sh, or use --with-cell or --offline.'
                )
            self._between_spins()
            self._executor.spin_once(timeout_sec=0.1)
        self._cast = self._who_publishes()

    def make_trial(self, key: TrialKey, seed: int, version: str) -> Trial:
        """Make one trial.

        Raises:
            TrialVoidError: it has to be made anew.
            CellGoneError: somebody who is needed is gone.
        """
        name, x_i, action = key.pair
        self._cast = self._who_publishes()
        self._set_up(name, x_i, seed)
        state, before = state_and_place(self._at_rest(self._now() + round(STALE * SECOND)), name)
        if state is not x_i:
            raise TrialVoidError(f'Expected to see the {name} {x_i.name}, got {state.name}.')
        expires = self._now() + round(EXPIRY * SECOND)
        request = messages.execute_request(name, action, expires)
        answer = self._answer(self._arm, request, MOTION_TIMEOUT)
        report = read_motion(answer)
        require_counted_motion(report)
        x_f, after = state_and_place(self._at_rest(max(report.finished, self._now()) + 1), name)
        self._check_cast()
        motion = report.outcome
        assert motion is not None, 'A motion that counts is one.'
        return Trial(key, x_f, MotionOutcome(motion), seed, version, time.time_ns(), before, after)

    def close(self) -> None:
        """Leave the graph."""
        self._executor.shutdown()
        self.destroy_node()

    def _set_up(self, name: str, x_i: State, seed: int) -> None:
        """The object in x_i and all others out of the way."""
        others = [other for other in self._sighting().objects if other != name]
        states = [State.OFFTABLE] * len(others) + [x_i]
        request = ResetCell.Request(
            objects=[*others, name], states=[int(state) for state in states], seed=seed
        )
        deadline = time.monotonic() + BUSY_PATIENCE
        while not (answer := self._answer(self._reset_client, request, RESET_TIMEOUT)).success:
            if time.monotonic() > deadline or 'in progress' not in answer.message:
                raise TrialVoidError(f'The table was not set up: {answer.message}')
            self._pause(RESET_PAUSE)

    def _at_rest(self, not_before: int) -> ObservedTable:
        """The first table state after a stamp (ns) in which all is at rest.

        What does not come to rest in time is taken as it is.
        """
        last = not_before + round(REST_TIMEOUT * SECOND)

        def rested() -> ObservedTable | None:
            table = self._sighting()
            good = table.stamp >= not_before and (table.settled or table.stamp > last)
            return table if good else None

        return self._until(rested, SIGHT_TIMEOUT, 'The camera saw no table at rest')

    def _answer(self, client: Any, request: Any, timeout: float) -> Any:
        future = client.call_async(request)
        try:
            self._until(future.done, timeout, f'{client.srv_name} gave no answer')
        except BaseException:
            client.remove_pending_request(future)
            raise
        return future.result()

    def _pause(self, seconds: float) -> None:
        end = time.monotonic() + seconds
        self._until(lambda: time.monotonic() >= end, seconds + 1.0, 'Time did not pass')

    def _until(self, predicate: Callable[[], T | None], timeout: float, failure: str) -> T:
        deadline = time.monotonic() + timeout
        while not (value := predicate()):
            now = time.monotonic()
            if now - self._heard > SILENCE:
                raise CellGoneError(f'The camera has been silent for {now - self._heard:.0f} s.')
            if now > deadline:
                raise TrialVoidError(f'{failure} within {timeout:.0f} s.')
            if now - self._glanced > GLANCE:
                self._check_cast()
            self._between_spins()
            self._executor.spin_once(timeout_sec=0.05)
        return value

    def _check_cast(self) -> None:
        self._glanced = time.monotonic()
        new = self._who_publishes() - self._cast
        if new:
            raise TrialVoidError('A part of the cell was started anew.')

    def _who_publishes(self) -> frozenset[bytes]:
        """Who publishes what the camera saw and what the arm does, by endpoint."""
        topics = 'table_state', 'joint_states'
        found = [info for topic in topics for info in self.get_publishers_info_by_topic(topic)]
        return frozenset(bytes(info.endpoint_gid) for info in found)

    def _sighting(self) -> ObservedTable:
        if self._table is None:
            raise CellGoneError('The camera has not seen anything yet.')
        return self._table

    def _now(self) -> int:
        """The newest stamp, ns: what was seen later is newer."""
        return self._sighting().stamp

    def _on_table(self, message: TableState) -> None:
        table = read_sighting(message)
        if self._table is not None and table.stamp < self._table.stamp:
            # The clock went back: the cell was started anew. _check_cast says so too, but later.
            self._cast = frozenset()
        self._table, self._heard = table, time.monotonic()


def read_sighting(message: TableState) -> ObservedTable:
    """A table state as the explorer keeps it."""
    objects = {item.name: _seen(item) for item in message.objects}
    return ObservedTable(stamp_ns(message.header.stamp), message.settled, objects)


def _seen(item: ObjectState) -> ObservedObject:
    state = State(item.state) if item.state in set(State) else None
    where = item.centroid.x, item.centroid.y, item.major_axis_yaw
    return ObservedObject(state, Place(*where) if item.visible else None)

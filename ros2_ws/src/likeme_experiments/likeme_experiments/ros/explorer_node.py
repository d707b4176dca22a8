"""Makes trials in the running cell, one after another, through its topics and services."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any, TypeVar

from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from sensor_msgs.msg import JointState

from likeme_core.outcomes import MotionOutcome, ResetOutcome
from likeme_core.ros.time import stamp_ns
from likeme_core.stamps import SECOND
from likeme_core.tabletop import State
from likeme_core.world import World
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
#: s without a table state after which camera or perception count as gone.
CAMERA_TIMEOUT = 4.0
#: s between two checks of the publishers.
PUBLISHER_CHECK_PERIOD = 0.5
#: s to wait for the answers of a reset and of a motion.
RESET_TIMEOUT, MOTION_TIMEOUT = 10.0, 120.0
#: s to wait for a motion that another client began, and between two requests meanwhile.
BUSY_TIMEOUT, BUSY_PERIOD = 90.0, 0.5
#: s of stamps: frames older than this may show the table before a reset; in which the table
#: settles; in which the arm may still start.
STALE, REST_TIMEOUT, EXPIRY = 0.5, 10.0, 5.0
#: s in which the camera must report a settled table, whatever the stamps.
SETTLED_TIMEOUT = 60.0


class ExplorerNode(Node):
    """Makes trials: resets the table, has the arm act, reads x_i and x_f from the camera.

    Subscribes: table_state (TableState): what the camera saw, before and after.
    Calls: cell/reset (ResetCell), arm/execute_action (ExecuteAction).
    Also checks the publishers of table_state and joint_states: when one of them was restarted
    since the trial began, the trial is void.
    """

    def __init__(
        self,
        world: World,
        context: Context | None = None,
        between_spins: Callable[[], None] = lambda: None,
    ) -> None:
        """world: of the cell. between_spins: called repeatedly while the node waits; may raise."""
        super().__init__('explorer', context=context, start_parameter_services=False)
        self._world, self._between_spins = world, between_spins
        self._executor = SingleThreadedExecutor(context=context)
        self._executor.add_node(self)
        self._table: ObservedTable | None = None
        self._received = time.monotonic()
        self._checked, self._known_publishers = 0.0, frozenset[bytes]()
        self.create_subscription(TableState, 'table_state', self._on_table, 1)
        # A subscription makes discovery report the publisher of this topic.
        self.create_subscription(JointState, 'joint_states', lambda _: None, 1)
        self._reset_client = self.create_client(ResetCell, 'cell/reset')
        self._arm = self.create_client(ExecuteAction, 'arm/execute_action')

    def wait_for_cell(self, timeout: float) -> None:
        """Return when the arm's service is available and a table state was received.

        Raises:
            CellGoneError: that took longer than `timeout` s.
        """
        self._table, deadline = None, time.monotonic() + timeout
        while not (self._table and self._arm.service_is_ready()):
            if time.monotonic() > deadline:
                domain = self.context.get_domain_id()
                raise CellGoneError(
                    f'No cell is running on ROS domain {domain}: start one with '
                    'scripts/start_cell.sh, or use --with-cell or --offline.'
                )
            self._between_spins()
            self._executor.spin_once(timeout_sec=0.1)
        self._known_publishers = self._current_publishers()

    def make_trial(self, key: TrialKey, seed: int, version: str) -> Trial:
        """Make one trial.

        Raises:
            TrialVoidError: it has to be made again.
            CellGoneError: arm, camera or perception is gone.
        """
        name, x_i, _ = key.pair
        self._known_publishers = self._current_publishers()
        self._set_up(name, x_i, seed)
        state, before = state_and_place(
            self._settled_table(self._now() + round(STALE * SECOND)), name
        )
        if state != x_i:
            raise TrialVoidError(f'Expected to see the {name} {x_i.name}, got {state.name}.')
        return self._act(key, before, seed, version)

    def close(self) -> None:
        """Shut down the executor and destroy the node."""
        self._executor.shutdown()
        self.destroy_node()

    def _act(self, key: TrialKey, before: Place | None, seed: int, version: str) -> Trial:
        """Have the arm act, and see where the object comes to rest."""
        name, _, action = key.pair
        expires = self._now() + round(EXPIRY * SECOND)
        request = messages.execute_request(self._world, name, action, expires)
        answer = self._call(self._arm, request, MOTION_TIMEOUT)
        report = read_motion(answer)
        require_counted_motion(report)
        x_f, after = state_and_place(
            self._settled_table(max(report.finished, self._now()) + 1), name
        )
        self._check_publishers()
        motion = report.outcome
        assert motion is not None, 'A motion that counts has an outcome.'
        return Trial(key, x_f, MotionOutcome(motion), seed, version, time.time_ns(), before, after)

    def _set_up(self, name: str, x_i: State, seed: int) -> None:
        """Put the object into x_i and all others out of the way."""
        others = [other for other in self._latest().objects if other != name]
        states = [self._world.regions.elsewhere] * len(others) + [x_i]
        request = ResetCell.Request(
            objects=[*others, name], states=[state.name for state in states], seed=seed
        )
        deadline = time.monotonic() + BUSY_TIMEOUT
        while not (answer := self._call(self._reset_client, request, RESET_TIMEOUT)).success:
            if time.monotonic() > deadline or answer.outcome != ResetOutcome.BUSY:
                raise TrialVoidError(f'The table was not set up: {answer.message}')
            self._pause(BUSY_PERIOD)

    def _settled_table(self, not_before: int) -> ObservedTable:
        """The first settled table state after a stamp, ns; after REST_TIMEOUT, any."""
        last = not_before + round(REST_TIMEOUT * SECOND)

        def settled() -> ObservedTable | None:
            table = self._latest()
            good = table.stamp >= not_before and (table.settled or table.stamp > last)
            return table if good else None

        return self._until(settled, SETTLED_TIMEOUT, 'The camera saw no settled table')

    def _call(self, client: Any, request: Any, timeout: float) -> Any:
        future = client.call_async(request)
        try:
            self._until(future.done, timeout, f'{client.srv_name} gave no answer')
        except BaseException:
            client.remove_pending_request(future)
            raise
        return future.result()

    def _pause(self, seconds: float) -> None:
        end = time.monotonic() + seconds
        self._until(lambda: time.monotonic() >= end, seconds + 1.0, 'The pause did not end')

    def _until(self, predicate: Callable[[], T | None], timeout: float, failure: str) -> T:
        deadline = time.monotonic() + timeout
        while not (value := predicate()):
            now = time.monotonic()
            if now - self._received > CAMERA_TIMEOUT:
                raise CellGoneError(f'No table state for {now - self._received:.0f} s.')
            if now > deadline:
                raise TrialVoidError(f'{failure} within {timeout:.0f} s.')
            if now - self._checked > PUBLISHER_CHECK_PERIOD:
                self._check_publishers()
            self._between_spins()
            self._executor.spin_once(timeout_sec=0.05)
        return value

    def _check_publishers(self) -> None:
        self._checked = time.monotonic()
        if self._current_publishers() - self._known_publishers:
            raise TrialVoidError('A node of the cell was restarted.')

    def _current_publishers(self) -> frozenset[bytes]:
        """Endpoints that publish table_state and joint_states."""
        topics = 'table_state', 'joint_states'
        found = [info for topic in topics for info in self.get_publishers_info_by_topic(topic)]
        return frozenset(bytes(info.endpoint_gid) for info in found)

    def _latest(self) -> ObservedTable:
        if self._table is None:
            raise CellGoneError('No table state was received yet.')
        return self._table

    def _now(self) -> int:
        """The newest stamp, ns."""
        return self._latest().stamp

    def _on_table(self, message: TableState) -> None:
        try:
            table = read_observed_table(message, self._world)
        except ValueError as error:
            self.get_logger().warning(str(error), throttle_duration_sec=CAMERA_TIMEOUT)
            return
        if self._table is not None and table.stamp < self._table.stamp:
            # The clock went back: the cell was restarted. Discovery reports that later.
            self._known_publishers = frozenset()
        self._table, self._received = table, time.monotonic()


def read_observed_table(message: TableState, world: World) -> ObservedTable:
    """The part of a table state that a trial needs.

    Raises:
        ValueError: it is of another world.
    """
    world.check_label(message.world)
    objects = {item.name: _seen(item, world) for item in message.objects}
    return ObservedTable(stamp_ns(message.header.stamp), message.settled, objects)


def _seen(item: ObjectState, world: World) -> ObservedObject:
    where = item.centroid.x, item.centroid.y, item.major_axis_yaw
    place = Place(*where) if item.visible else None
    return ObservedObject(world.state_at(item.state), place, stamp_ns(item.last_seen) > 0)

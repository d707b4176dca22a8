"""What the nodes of all arm drivers have in common."""

from __future__ import annotations

import traceback
from abc import abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any

from rclpy.node import Node

from likeme_arm import messages
from likeme_arm.hold_monitor import Block, HoldMonitor
from likeme_arm.motion_driver import MotionDriver
from likeme_arm.motion_journal import MotionJournal, MotionRecord
from likeme_arm.ros.hold_topics import HoldTopics
from likeme_arm.ros.motion_action import MotionAction
from likeme_arm.ros.motion_service import SERVICES, MotionService
from likeme_core.heartbeats import NodeState
from likeme_core.outcomes import Actor
from likeme_core.ros import parameters
from likeme_core.ros.diagnostics import DiagnosticsPublisher
from likeme_core.ros.heartbeat import HeartbeatPublisher
from likeme_core.ros.other_servers import other_servers
from likeme_core.ros.qos import kept
from likeme_core.ros.state_folder import state_folder_of
from likeme_core.ros.time import steady_clock
from likeme_core.ros.world import WorldPublisher, declare_world
from likeme_core.settings import Setting
from likeme_msgs.msg import Motion

#: Motions that late subscribers of `motion` receive.
MOTIONS_KEPT = 100
#: s between log lines about errors.
ERROR_PERIOD = 5.0


class MotionDriverNode(Node):
    """Node `arm_driver`: requests to move, the hold and the journal of a MotionDriver.

    A subclass creates `_journal` and `_driver`, then calls `_serve_motions`, and at last
    `_start_driver`.

    Publishes motion (Motion, reliable, transient local, depth 100), world (World, latched),
    heartbeat (Heartbeat), /diagnostics (DiagnosticArray, 1 Hz). Subscribes cell/hold_state
    (HoldState), cell/stop (String). Serves for each actor ACTOR/execute_action (ExecuteAction,
    service and action) and ACTOR/motion_status (MotionStatus). Client: cell/hold (Trigger).
    """

    _journal: MotionJournal
    _driver: MotionDriver
    #: Before the traceback of an error in the log.
    _error_prefix = ''

    def __init__(self, settings: Mapping[str, Setting]) -> None:
        """settings: the parameters; hold_timeout is among them."""
        super().__init__('arm_driver')
        self._world = declare_world(self)
        parameters.declare(self, settings)
        self._values = parameters.values(self, settings)
        self._hold = HoldMonitor(self._values['hold_timeout'])
        self._motion_pub = self.create_publisher(Motion, 'motion', kept(MOTIONS_KEPT))
        self._motions: list[MotionService] = []
        self._actions: list[MotionAction] = []

    @abstractmethod
    def _facts(self) -> dict[str, Any]:
        """What /diagnostics reports beside the counts of motions."""

    @property
    @abstractmethod
    def _hardware(self) -> str:
        """What moves, for /diagnostics."""

    def stop(self) -> None:
        """Hold a running motion and wait until nothing is being published."""
        self._driver.stop()

    def destroy_node(self) -> None:
        """Stop the driver's thread and destroy the node."""
        self.stop()
        self._journal.close()
        for action in self._actions:
            action.destroy()
        super().destroy_node()

    def _open_journal(self) -> MotionJournal:
        return MotionJournal(state_folder_of(self) / 'motions.sqlite')

    def _refuse_second(self, actors: Sequence[Actor]) -> None:
        """Raise ValueError if another node moves one of these actors."""
        conflicts = other_servers(self, [SERVICES[actor] for actor in actors])
        if conflicts:
            raise ValueError(conflicts[0])

    def _serve_motions(self, actors: Sequence[Actor]) -> None:
        self._motions = [
            MotionService(self, self._driver, actor, self._journal) for actor in actors
        ]
        self._actions = [MotionAction(self, self._driver, motion) for motion in self._motions]

    def _start_driver(self) -> None:
        """Publish and hear what every driver does, tell of lost motions, and start."""
        self._world_pub = WorldPublisher(self, self._world)
        self._hold_topics = HoldTopics(self, self._hold)
        self._heartbeat = HeartbeatPublisher(self, self._health)
        for lost in self._journal.lost:
            self.get_logger().warning(f'{lost.action} of the {lost.object}: {lost.message}')
            self._on_motion(lost)
        self._diagnostics = DiagnosticsPublisher(self)
        self.create_timer(1.0, self._diagnose, clock=steady_clock())
        self._driver.start()

    def _on_motion(self, record: MotionRecord) -> None:
        """When a motion begins and when it has ended, in the driver's thread."""
        self._motion_pub.publish(messages.motion_msg(record, self._driver.now))

    def _on_error(self, error: Exception) -> None:
        text = ''.join(traceback.format_exception(error)).strip()
        self.get_logger().error(f'{self._error_prefix}{text}', throttle_duration_sec=ERROR_PERIOD)

    def _health(self) -> tuple[NodeState, str]:
        if self._hold.block is Block.UNHEARD:
            return NodeState.DEGRADED, Block.UNHEARD.sentence
        return NodeState.READY, ''

    def _diagnose(self) -> None:
        conflicts = other_servers(self, [motion.name for motion in self._motions])
        counts = {
            'motions': sum(motion.motions for motion in self._motions),
            'refused': sum(motion.refused for motion in self._motions),
        }
        self._diagnostics.publish(
            messages.diagnostics_message(
                self._driver, counts | self._facts(), self._hardware, conflicts
            )
        )

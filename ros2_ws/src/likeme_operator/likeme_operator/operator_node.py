"""The node of an operator's desk."""

from __future__ import annotations

import re
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.signals import SignalHandlerOptions
from std_srvs.srv import Trigger

from likeme_arm.ros.stop_command import StopNode
from likeme_core.cli import set_discovery
from likeme_core.ros.heartbeat import HeartbeatSubscriber
from likeme_core.ros.qos import LATCHED
from likeme_core.ros.time import time_msg
from likeme_core.ros.world import WorldNames
from likeme_inference.tabletop.values import Reply
from likeme_msgs.msg import HelpRequest
from likeme_msgs.msg import World as WorldMsg
from likeme_msgs.srv import AskHuman
from likeme_operator.desk_view import QuestionKey

#: s to wait for a service and for its answer.
SERVICE_TIMEOUT = 8.0
#: s to wait for the topic world.
WORLD_TIMEOUT = 2.0
#: s after which a request without an answer is sent again.
REPEAT_PERIOD = 1.0
#: s between two looks at what is waited for.
POLL_PERIOD = 0.02
#: s without a heartbeat after which an operator is told: shorter gaps are seen on a loaded host.
SILENCE = 0.7
#: Names of nodes that are desks, with the operator's name in them.
PREFIX = 'operator_of_'


class ServiceAbsentError(Exception):
    """A service of the cell is absent or does not answer."""


class OperatorNode(StopNode):
    """Stops the cell, answers its questions, and resumes.

    Publishes:
        cell/stop (String): see StopNode
    Subscribes:
        cell/hold_state (HoldState), heartbeat (Heartbeat), world (World)
    Clients:
        ask_human (AskHuman), cell/resume (Trigger)

    A thread of its own spins it (see `operator_node`); its methods block the caller alone.
    """

    def __init__(self, by: str) -> None:
        """by: name of the operator."""
        super().__init__(PREFIX + re.sub(r'\W', '_', by, flags=re.ASCII))
        self.by = by
        self.monitor = HeartbeatSubscriber(self).monitor
        self.names = WorldNames(None)
        self._asking = self.create_client(AskHuman, 'ask_human')
        self._resuming = self.create_client(Trigger, 'cell/resume')
        self.create_subscription(WorldMsg, 'world', self._on_world, LATCHED)

    def pending(self) -> list[HelpRequest]:
        """Pending requests, oldest first.

        Raises:
            ServiceAbsentError: nobody serves ask_human.
        """
        request = AskHuman.Request(command=AskHuman.Request.LIST)
        return list(self.call(self._asking, request).pending)

    def ask_for_pending(self, told: Callable[[list[HelpRequest]], None]) -> None:
        """Ask for the pending requests without waiting; `told` is called by the node's thread."""
        if not self._asking.service_is_ready():
            return
        future = self._asking.call_async(AskHuman.Request(command=AskHuman.Request.LIST))
        future.add_done_callback(lambda done: told(list(done.result().pending)))

    def answer(
        self,
        key: QuestionKey,
        reply: Reply,
        goal: str = '',
        give_up: Callable[[], bool] = lambda: False,
    ) -> Any:
        """Answer the question that was read; the service's response.

        goal: name of the region that NAME_GOAL names.

        Raises:
            ServiceAbsentError: nobody serves ask_human, or `give_up` came true.
        """
        return self.call(
            self._asking,
            AskHuman.Request(
                command=AskHuman.Request.ANSWER,
                request_id=key.id,
                answer=reply,
                answered_by=self.by,
                object=key.object,
                action=key.action,
                stamp=time_msg(key.stamp),
                goal=goal,
            ),
            give_up,
        )

    def resume(self) -> Any:
        """Allow motion again; the service's response.

        Raises:
            ServiceAbsentError: nobody serves cell/resume.
        """
        return self.call(self._resuming, Trigger.Request())

    def wait_for_world(self) -> WorldNames:
        """The names of states and actions; their numbers if nobody publishes them."""
        self.until(lambda: self.names.message is not None, WORLD_TIMEOUT)
        return self.names

    def silence_of(self, name: str) -> float:
        """s since a node of this name was heard; infinite if it never was."""
        now = time.monotonic()
        known = [each for each in list(self.monitor.nodes) if each.endswith(f'/{name}')]
        return min((self.monitor.silence(each, now) for each in known), default=float('inf'))

    def other_operators(self) -> list[str]:
        """Names of the operators whose desks are connected, without this one."""
        own = self.get_name()
        desks = {name for name in self.get_node_names() if name.startswith(PREFIX)} - {own}
        return sorted(name.removeprefix(PREFIX).rpartition('_')[0] for name in desks)

    def until(self, condition: Callable[[], Any], timeout: float) -> bool:
        """Whether a condition comes true within `timeout`, s."""
        deadline = time.monotonic() + timeout
        while not condition():
            if time.monotonic() > deadline:
                return False
            time.sleep(POLL_PERIOD)
        return True

    def call(self, client: Any, request: Any, give_up: Callable[[], bool] = lambda: False) -> Any:
        """Call a service and wait for its answer.

        It is called again until it answers: what is sent while a killed server is still listed is
        lost. So only for requests that may arrive twice.

        Raises:
            ServiceAbsentError: it is absent, goes away, does not answer, or `give_up` came true.
        """
        name = client.srv_name.lstrip('/')
        self.until(lambda: client.service_is_ready() or give_up(), SERVICE_TIMEOUT)
        if not client.service_is_ready():
            domain = self.context.get_domain_id()
            raise ServiceAbsentError(
                f'Expected the service {name} on ROS domain {domain} within {SERVICE_TIMEOUT:g} '
                's, got none: is the cell running? Start it: ./scripts/start_cell.sh'
            )
        deadline, futures = time.monotonic() + SERVICE_TIMEOUT, []
        while time.monotonic() < deadline:
            futures.append(client.call_async(request))
            self.until(lambda: any(f.done() for f in futures) or give_up(), REPEAT_PERIOD)
            if done := [future for future in futures if future.done()]:
                return done[0].result()
            if give_up():
                break
        raise ServiceAbsentError(
            f'Expected an answer of {name}, got none: '
            './scripts/cell.sh status tells which node is missing.'
        )

    def _on_world(self, message: WorldMsg) -> None:
        self.names = WorldNames(message)


@contextmanager
def operator_node(
    by: str, network: bool, domain: int, create: Callable[[str], Any] = OperatorNode
) -> Iterator[Any]:
    """A node that a thread of its own spins; signals go to the caller's thread alone."""
    set_discovery(network)
    rclpy.init(args=[], domain_id=domain, signal_handler_options=SignalHandlerOptions.NO)
    node = create(by)
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    thread = threading.Thread(target=executor.spin, daemon=True)
    thread.start()
    try:
        yield node
    finally:
        executor.shutdown()
        thread.join(5.0)
        node.destroy_node()
        rclpy.try_shutdown()

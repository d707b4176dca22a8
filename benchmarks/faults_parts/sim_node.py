"""A Node on a simulated graph, in place of rclpy's: what the cell's nodes use of it."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import rclpy.lifecycle
import rclpy.node
from builtin_interfaces.msg import Time
from lifecycle_msgs.msg import State
from rclpy.lifecycle import LifecycleState, TransitionCallbackReturn
from rclpy.qos import DurabilityPolicy

from faults_parts.sim_graph import Client, Graph, Publisher, Serve, Service, Source, Subscription
from faults_parts.sim_time import SECOND, SIM_TIME


class Silent:
    """A logger that says nothing."""

    def _say(self, *_: Any, **__: Any) -> None:
        pass

    debug = info = warning = error = fatal = _say


class SimNode:
    """A node of the process that is being started, with the graph's parameters for its name."""

    context = SimpleNamespace(get_domain_id=lambda: 0)

    def __init__(self, name: str, **_: Any) -> None:
        self._graph = Graph.current
        assert self._graph.starting is not None, 'Nodes are created in a process.'
        self.process, self._name = self._graph.starting, name
        self._parameters: dict[str, Any] = {}

    def get_name(self) -> str:
        return self._name

    def get_namespace(self) -> str:
        return '/'

    def get_fully_qualified_name(self) -> str:
        return f'/{self._name}'

    def get_logger(self) -> Silent:
        return Silent()

    def get_clock(self) -> Any:
        now = SimpleNamespace(
            to_msg=lambda: time_msg(SIM_TIME.system), nanoseconds=SIM_TIME.system
        )
        return SimpleNamespace(now=lambda: now)

    def declare_parameter(self, name: str, value: Any, _descriptor: Any = None) -> Any:
        self._parameters[name] = self._graph.parameters.get(self._name, {}).get(name, value)
        return self.get_parameter(name)

    def get_parameter(self, name: str) -> Any:
        return SimpleNamespace(name=name, value=self._parameters[name])

    def add_on_set_parameters_callback(self, _callback: Any) -> None:
        pass

    def add_post_set_parameters_callback(self, _callback: Any) -> None:
        pass

    def resolve_service_name(self, name: str) -> str:
        return f'/{name}'

    def get_node_names_and_namespaces(self) -> list[tuple[str, str]]:
        return []

    def create_publisher(self, _kind: Any, topic: str, qos: Any, **_: Any) -> Publisher:
        publisher = Publisher(self.process, topic, *_depth_latched(qos))
        self._graph.publishers.append(publisher)
        return publisher

    def create_subscription(
        self, _kind: Any, topic: str, callback: Callable[[Any], None], qos: Any, **_: Any
    ) -> Subscription:
        depth, latched = _depth_latched(qos)
        subscription = Subscription(self.process, callback, depth)
        self._graph.subscriptions.setdefault(topic, []).append(subscription)
        for publisher in self._graph.publishers:
            if latched and publisher.latched and publisher.topic == topic:
                for message in publisher.kept:
                    self._graph.send(topic, message, self.process, subscription.deliver)
        return subscription

    def create_timer(self, period: float, callback: Callable[[], None], **_: Any) -> None:
        source = Source(self.process, 1)

        def fire() -> None:
            if self.process.alive:
                source.add(callback)
                self._graph.after(period, fire)

        self._graph.after(period, fire)

    def create_service(self, _kind: Any, name: str, callback: Any, **_: Any) -> Service:
        kind = _kind

        def serve(request: Any, respond: Callable[[Any], None]) -> None:
            respond(callback(request, kind.Response()))

        return self.serve(name, serve)

    def serve(self, name: str, serve: Serve) -> Service:
        """Serve, with the response at any later time."""
        service = self._graph.services[name] = Service(self.process, serve)
        return service

    def create_client(self, _kind: Any, name: str, **_: Any) -> Client:
        return Client(self.process, name)


class SimLifecycleNode(SimNode):
    """A node with the transitions that it begins itself."""

    def trigger_configure(self) -> TransitionCallbackReturn:
        return TransitionCallbackReturn.SUCCESS

    def trigger_activate(self) -> TransitionCallbackReturn:
        return self.on_activate(LifecycleState('inactive', State.PRIMARY_STATE_INACTIVE))

    def on_activate(self, _state: LifecycleState) -> TransitionCallbackReturn:
        return TransitionCallbackReturn.SUCCESS


def time_msg(nanoseconds: int) -> Time:
    """The message of a stamp in ns."""
    return Time(sec=nanoseconds // SECOND, nanosec=nanoseconds % SECOND)


def install() -> None:
    """Have nodes that are imported from now on derive from these."""
    rclpy.node.Node = SimNode  # type: ignore[assignment,misc]
    rclpy.lifecycle.LifecycleNode = SimLifecycleNode  # type: ignore[assignment,misc]


def _depth_latched(qos: Any) -> tuple[int, bool]:
    if isinstance(qos, int):
        return qos, False
    return qos.depth, qos.durability == DurabilityPolicy.TRANSIENT_LOCAL

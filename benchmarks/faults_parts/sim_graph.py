"""A ROS graph in one process and in simulated time: what nodes need of rclpy, with faults.

A process runs its callbacks one by one, as a SingleThreadedExecutor does. Topics deliver in order;
queues keep the last messages, as many as their depth says. A process that was killed leaves its
services visible for a while, as DDS does.
"""

from __future__ import annotations

import heapq
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from inspect import signature
from itertools import count
from typing import Any

from faults_parts.sim_time import SECOND, SIM_TIME

#: s from the publication of a message to its arrival.
LATENCY = 0.001
#: s for which the services of a killed process still seem to be there.
LEASE = 20.0

Route = Callable[[str, Any, 'Process'], list[tuple[float, Any]] | None]


class Killed(BaseException):
    """The process was killed while it ran this callback."""


class Process:
    """One process with one node.

    Attributes:
        name: of the node.
        alive: until it is killed.
        paused: by SIGSTOP.
        delay: s that every callback takes beyond none.
    """

    def __init__(self, graph: Graph, name: str) -> None:
        self.graph, self.name = graph, name
        self.alive, self.paused, self.delay = True, False, 0.0
        self.sources: list[Source] = []
        self._busy_until, self._woken = 0, False

    def wake(self) -> None:
        """Run what is ready, when the process is free."""
        if not self._woken:
            self._woken = True
            self.graph.at(max(SIM_TIME.now, self._busy_until), self._spin)

    def pause(self) -> None:
        """SIGSTOP."""
        self.paused = True

    def resume(self) -> None:
        """SIGCONT."""
        self.paused = False
        self.wake()

    def kill(self) -> None:
        """SIGKILL; raises Killed in the process's own callback."""
        if self.alive:
            self.alive = False
            self.graph.forget(self)
            if self.graph.running is self:
                raise Killed

    def _spin(self) -> None:
        self._woken = False
        if not self.alive or self.paused:
            return
        graph = self.graph
        graph.running = self
        try:
            for source in list(self.sources):
                if source.run() and self.delay:
                    self._busy_until = SIM_TIME.now + round(self.delay * SECOND)
                    break
        except Killed:
            self.kill()
            return
        finally:
            graph.running = None
        if any(source.ready for source in self.sources):
            self.wake()


class Source:
    """What a process waits for: callbacks that are ready, the newest `depth` of them."""

    def __init__(self, process: Process, depth: int) -> None:
        self._process = process
        self._queue: deque[Callable[[], None]] = deque(maxlen=depth)
        process.sources.append(self)

    @property
    def ready(self) -> bool:
        """Whether there is something to run."""
        return bool(self._queue)

    def add(self, callback: Callable[[], None]) -> None:
        """Make a callback ready."""
        self._queue.append(callback)
        self._process.wake()

    def run(self) -> bool:
        """Run the oldest one; whether there was one."""
        if not self._queue or not self._process.alive:
            return False
        self._queue.popleft()()
        return True


class Subscription:
    """A subscription of a process."""

    def __init__(self, process: Process, callback: Callable[[Any], None], depth: int) -> None:
        self.process, self._callback = process, callback
        self._source = Source(process, depth)
        # As rclpy does: a callback with two parameters gets the times, too.
        self._with_times = len(signature(callback).parameters) == 2

    def deliver(self, message: Any) -> None:
        """A message has arrived."""
        times = ({'received_timestamp': SIM_TIME.system},) if self._with_times else ()
        self._source.add(lambda: self._callback(message, *times))


class Publisher:
    """A publisher of a process; keeps the last messages for late subscribers if it is latched."""

    def __init__(self, process: Process, topic: str, depth: int, latched: bool) -> None:
        self.process, self.topic, self.latched = process, topic, latched
        self.kept: deque[Any] = deque(maxlen=depth)

    def publish(self, message: Any) -> None:
        """Send a message to the topic's subscribers, and show it to the observers."""
        graph = self.process.graph
        self.kept.append(message)
        for observer in graph.observers:
            observer(self.topic, message)
        for subscription in list(graph.subscriptions.get(self.topic, ())):
            graph.send(self.topic, message, subscription.process, subscription.deliver)
        graph.happens(f'publish {self.topic}')


class Future:
    """The future of a service call."""

    def __init__(self) -> None:
        self._done: list[Callable[[Future], None]] = []
        self._result: Any = None

    def add_done_callback(self, callback: Callable[[Future], None]) -> None:
        """Call when the response has arrived."""
        self._done.append(callback)

    def result(self) -> Any:
        """The response."""
        return self._result

    def set_result(self, response: Any) -> None:
        """The response has arrived."""
        self._result = response
        for callback in self._done:
            callback(self)


Serve = Callable[[Any, Callable[[Any], None]], None]


class Service:
    """A service of a process; `serve` takes a request and a function that sends the response."""

    def __init__(self, process: Process, serve: Serve) -> None:
        self.process, self._serve = process, serve
        self._source = Source(process, 100)

    def request(self, request: Any, respond: Callable[[Any], None]) -> None:
        """A request has arrived."""
        self._source.add(lambda: self._serve(request, respond))


class Client:
    """A client of a service."""

    def __init__(self, process: Process, name: str) -> None:
        self._process, self._name = process, name
        self._source = Source(process, 100)

    def service_is_ready(self) -> bool:
        """Whether a server seems to be there."""
        graph = self._process.graph
        return self._name in graph.services or graph.ghosts.get(self._name, 0) > SIM_TIME.now

    def call_async(self, request: Any) -> Future:
        """Send a request; the response may never come."""
        graph, future = self._process.graph, Future()
        graph.happens(f'request {self._name}')
        server = graph.services.get(self._name)
        if server is not None:

            def arrive(sent: Any) -> None:
                server.request(sent, lambda response: self._respond(response, future))

            graph.send(f'request {self._name}', request, server.process, arrive)
        return future

    def _respond(self, response: Any, future: Future) -> None:
        graph, topic = self._process.graph, f'response {self._name}'
        graph.happens(topic)
        graph.send(
            topic, response, self._process,
            lambda sent: self._source.add(lambda: future.set_result(sent)),
        )  # fmt: skip


class Graph:
    """The graph.

    Attributes:
        services: by name.
        ghosts: until when services of killed processes still seem to be there, ns.
        routes: faults of the transport: None leaves a message alone, else how often, how late
            (s) and as what it arrives.
        observers: see every message when it is published, as topic and message.
        watchers: are told of every event by its name.
        starting: the process that creates nodes now.
        running: the process whose callback runs now.
    """

    current: Graph

    def __init__(self) -> None:
        self.subscriptions: dict[str, list[Subscription]] = {}
        self.publishers: list[Publisher] = []
        self.services: dict[str, Service] = {}
        self.ghosts: dict[str, int] = {}
        self.routes: list[Route] = []
        self.observers: list[Callable[[str, Any], None]] = []
        self.watchers: list[Callable[[str], None]] = []
        self.parameters: dict[str, dict[str, Any]] = {}
        self.starting: Process | None = None
        self.running: Process | None = None
        self._events: list[tuple[int, int, Callable[[], None]]] = []
        self._numbers = count()
        Graph.current = self

    def at(self, when: int, event: Callable[[], None]) -> None:
        """Have something happen at a time, ns."""
        heapq.heappush(self._events, (when, next(self._numbers), event))

    def after(self, seconds: float, event: Callable[[], None]) -> None:
        """Have something happen after some s."""
        self.at(SIM_TIME.now + round(seconds * SECOND), event)

    def run(self, seconds: float, until: Callable[[], bool] = lambda: False) -> bool:
        """Let time pass for some s, or until something holds; whether it does."""
        end = SIM_TIME.now + round(seconds * SECOND)
        while self._events and self._events[0][0] <= end:
            when, _, event = heapq.heappop(self._events)
            SIM_TIME.now = max(SIM_TIME.now, when)
            event()
            if until():
                return True
        SIM_TIME.now = end
        return until()

    @contextmanager
    def process(self, name: str) -> Iterator[Process]:
        """A process, for the nodes that are created in the block; Killed ends both."""
        begun = self.starting = self.running = Process(self, name)
        try:
            yield begun
        except Killed:
            begun.kill()
        finally:
            self.starting = self.running = None

    def happens(self, event: str) -> None:
        """Tell the watchers of an event."""
        for watcher in list(self.watchers):
            watcher(event)

    def send(
        self, topic: str, message: Any, target: Process, deliver: Callable[[Any], None]
    ) -> None:
        """Carry a message to a process, as the routes say."""
        arrivals: list[tuple[float, Any]] = [(0.0, message)]
        for route in self.routes:
            changed = route(topic, message, target)
            arrivals = arrivals if changed is None else changed
        for late, arriving in arrivals:

            def arrive(arriving: Any = arriving) -> None:
                if target.alive:
                    deliver(arriving)

            self.after(LATENCY + late, arrive)

    def forget(self, process: Process) -> None:
        """Take a killed process out of the graph."""
        for topic, there in self.subscriptions.items():
            self.subscriptions[topic] = [s for s in there if s.process is not process]
        self.publishers = [p for p in self.publishers if p.process is not process]
        for name in [n for n, s in self.services.items() if s.process is process]:
            del self.services[name]
            self.ghosts[name] = SIM_TIME.now + round(LEASE * SECOND)
        process.sources.clear()

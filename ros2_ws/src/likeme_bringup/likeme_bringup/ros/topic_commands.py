"""Command `topic`: `list`, `echo` and `hz`, as `ros2 topic` has them.

Exit codes: 0 done, 1 no message came, 2 wrong usage, 3 no such topic or no node, 130 Ctrl-C.
"""

from __future__ import annotations

import itertools
import json
import os
import statistics
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Annotated, Any

import rclpy
import typer
import yaml
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from likeme_bringup.nearest_names import nearest
from likeme_bringup.ros.cell_commands import application, report
from likeme_bringup.ros.message_values import plain_value
from likeme_bringup.ros.service_client import (
    DISCOVERY_TIMEOUT,
    POLL_PERIOD,
    CallResult,
    client_node,
    domain_of,
)
from likeme_core.cli import Domain, Network
from likeme_core.ros.message_types import message_class

#: s that discovery goes on after the first topic of others was found.
SETTLE = 1.0
#: Topics of this process, and of every node.
COMMON = ('/rosout', '/parameter_events')
TopicName = Annotated[str, typer.Argument(metavar='TOPIC', help='e.g. table_state.')]
Json = Annotated[bool, typer.Option('--json', help='A JSON document, or one a line.')]


class Topics:
    """What is published on a domain, as one node sees it."""

    def __init__(self, node: Node) -> None:
        self._node = node

    def all(self) -> dict[str, tuple[str, int, int]]:
        """Type, number of publishers and of subscribers of each; exits if nobody else is there."""
        if not self._spin(DISCOVERY_TIMEOUT, self._others):
            domain = domain_of(self._node)
            report(
                CallResult(
                    3,
                    f'No other node on ROS domain {domain}: is the cell running? Start it: '
                    './scripts/start_cell.sh',
                )
            )
        self._spin(SETTLE, lambda: False)
        return {
            name: (types[0], self._node.count_publishers(name), self._node.count_subscribers(name))
            for name, types in sorted(self._node.get_topic_names_and_types())
        }

    def find(self, name: str) -> tuple[str, str]:
        """Full name and type of a published topic; exits with the nearest names if there is none.

        It is given without the slash or the namespace, too.
        """
        topics = self.all()
        ends = [each for each in topics if each.endswith(f'/{name.strip("/")}')]
        exact = f'/{name.strip("/")}'
        found = exact if exact in topics else ends[0] if len(ends) == 1 else None
        if found is not None:
            return found, topics[found][0]
        near = ', '.join(nearest(name, list(topics))) or ', '.join(topics)
        sentence = f'There is no topic {name} on ROS domain {domain_of(self._node)}.'
        return report(CallResult(3, f'{sentence} The nearest: {near}.'))

    def _others(self) -> bool:
        own = self._node.get_name()
        return any(name != own for name in self._node.get_node_names())

    def _spin(self, timeout: float, done: Callable[[], bool]) -> bool:
        deadline = time.monotonic() + timeout
        while not done() and time.monotonic() < deadline:
            rclpy.spin_once(self._node, timeout_sec=0.05)
        return done()


def list_command(as_json: Json = False, network: Network = False, domain: Domain = 0) -> None:
    """Every topic with its type and how many publish and read it."""
    with _until_interrupted(), client_node(network, domain) as node:
        topics = Topics(node).all()
    shown = {name: about for name, about in topics.items() if name not in COMMON}
    if as_json:
        keys = ('type', 'publishers', 'subscribers')
        text = json.dumps(
            {name: dict(zip(keys, about, strict=True)) for name, about in shown.items()}, indent=2
        )
    else:
        width = max(map(len, shown), default=0)
        text = '\n'.join(
            f'{name:{width}}  {kind}, {writers} to {readers}'
            for name, (kind, writers, readers) in shown.items()
        )
    report(CallResult(0, text))


def echo_command(
    topic: TopicName,
    count: Annotated[
        int, typer.Option('--count', '-n', min=0, help='End after so many; 0: never.')
    ] = 0,
    as_json: Json = False,
    network: Network = False,
    domain: Domain = 0,
) -> None:
    """Print the messages of a topic as YAML; long arrays are cut, but not with --json."""
    shown = 0

    def show(message: Any) -> None:
        nonlocal shown
        if count and shown == count:
            return
        shown += 1
        value = plain_value(message, cut=not as_json)
        dumped = json.dumps(value) if as_json else yaml.safe_dump(value, sort_keys=False) + '---'
        print(dumped)

    with _until_interrupted(), client_node(network, domain) as node:
        _subscribe(node, topic, show)
        first = time.monotonic() + DISCOVERY_TIMEOUT
        while not count or shown < count:
            rclpy.spin_once(node, timeout_sec=POLL_PERIOD)
            if not shown and time.monotonic() > first:
                _say_waiting(topic)
                first = float('inf')


def hz_command(
    topic: TopicName,
    seconds: Annotated[
        float, typer.Option(min=0.1, max=3600, help='How long messages are counted, s.')
    ] = 5.0,
    as_json: Json = False,
    network: Network = False,
    domain: Domain = 0,
) -> None:
    """Measure the rate of a topic and the longest gap. Exit code 1: fewer than two messages."""
    times: list[float] = []
    with _until_interrupted(), client_node(network, domain) as node:
        name = _subscribe(node, topic, lambda _: times.append(time.monotonic()))
        began = time.monotonic()
        while time.monotonic() < began + seconds:
            rclpy.spin_once(node, timeout_sec=0.05)
    gaps = [later - earlier for earlier, later in itertools.pairwise(times)]
    if not gaps:
        report(
            CallResult(1, f'{name}: expected two messages within {seconds:g} s, got {len(times)}.')
        )
    rate, longest, spread = 1 / statistics.fmean(gaps), max(gaps), statistics.pstdev(gaps)
    figures = {
        'topic': name,
        'hz': rate,
        'messages': len(times),
        'longest_gap': longest,
        'deviation': spread,
    }
    text = (
        f'{name}: {rate:.2f} Hz, {len(times)} messages; longest gap {longest * 1e3:.0f} ms, '
        f'standard deviation {spread * 1e3:.1f} ms'
    )
    report(CallResult(0, json.dumps(figures) if as_json else text))


@contextmanager
def _until_interrupted() -> Iterator[None]:
    try:
        yield
    except (KeyboardInterrupt, ExternalShutdownException):
        raise typer.Exit(130) from None
    except BrokenPipeError:
        # Python flushes stdout once more at its end.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        raise typer.Exit(141) from None


def _subscribe(node: Node, topic: str, take: Callable[[Any], None]) -> str:
    """Subscribe to a topic with what its publishers offer; its full name."""
    name, kind = Topics(node).find(topic)
    message = message_class(kind)
    if message is None:
        report(CallResult(3, f'{name} has the type {kind}, which is not installed here.'))
    node.create_subscription(message, name, take, _offered(node, name))
    return name


def _offered(node: Node, name: str) -> QoSProfile:
    """A profile that every publisher of a topic serves, and that gets kept messages."""
    offers = [info.qos_profile for info in node.get_publishers_info_by_topic(name)]
    reliable = all(each.reliability == ReliabilityPolicy.RELIABLE for each in offers)
    latched = all(each.durability == DurabilityPolicy.TRANSIENT_LOCAL for each in offers)
    return QoSProfile(
        depth=100,
        reliability=(
            ReliabilityPolicy.RELIABLE if offers and reliable else ReliabilityPolicy.BEST_EFFORT
        ),
        durability=(
            DurabilityPolicy.TRANSIENT_LOCAL if offers and latched else DurabilityPolicy.VOLATILE
        ),
    )


def _say_waiting(topic: str) -> None:
    print(f'No message of {topic} yet; still waiting, Ctrl-C ends.', file=sys.stderr)


def topic() -> None:
    """Entry point of `topic`."""
    application(('list', list_command), ('echo', echo_command), ('hz', hz_command))()


if __name__ == '__main__':
    topic()

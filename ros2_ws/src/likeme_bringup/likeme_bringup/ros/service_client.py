"""Calls a service of a running cell once, from a short-lived node."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node

from likeme_core.cli import set_discovery
from likeme_msgs.msg import TableState

# For a service or a first message to appear, s. With the start of Python, a caller reports within
# 10 s that there is no cell.
DISCOVERY_TIMEOUT = 8.0
# For an answer, s. No motion takes longer: its server was replaced by another one meanwhile.
ANSWER_TIMEOUT = 180.0
# Between two calls of a request that may be repeated, s.
REPEAT_PERIOD = 1.0
# Between two checks that the server still exists, s.
POLL_PERIOD = 0.5


class CallResult(NamedTuple):
    """Exit code of a caller, and the message it prints."""

    code: int
    message: str


@contextmanager
def client_node(network: bool, domain: int) -> Iterator[Node]:
    """A short-lived node."""
    set_discovery(network)
    rclpy.init(domain_id=domain)
    node = Node(f'caller_{os.getpid()}')
    try:
        yield node
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


def call(node: Node, kind: Any, name: str, request: Any, repeated: bool = False) -> CallResult:
    """Call a service whose response has `success` and `message`.

    repeated: call again every s until it answers, for requests that may arrive twice: what is sent
    while a killed server is still listed may be lost.
    """
    client = node.create_client(kind, name)
    if not client.wait_for_service(timeout_sec=DISCOVERY_TIMEOUT):
        return CallResult(
            3, f'Nobody serves {name} on ROS domain {domain_of(node)}: is the cell running?'
        )
    futures = [client.call_async(request)]
    try:
        return _wait_for_response(node, client, futures, request if repeated else None)
    except (KeyboardInterrupt, ExternalShutdownException):
        return CallResult(
            130, f'No longer waiting for {name}. A motion goes on; `cell.sh hold` stops it.'
        )


def _wait_for_response(
    node: Node, client: Any, futures: list[Any], again: Any | None
) -> CallResult:
    """Wait until a response comes, its server is gone, or ANSWER_TIMEOUT has passed.

    again: the request to repeat; None: it is sent once.
    """
    deadline, sent = time.monotonic() + ANSWER_TIMEOUT, time.monotonic()
    while not (done := [future for future in futures if future.done()]):
        rclpy.spin_once(node, timeout_sec=POLL_PERIOD)
        now = time.monotonic()
        if any(future.done() for future in futures):
            continue
        if not client.service_is_ready():
            return CallResult(3, f'{client.srv_name} went away before it answered.')
        if now > deadline:
            return CallResult(3, f'{client.srv_name} gave no answer within {ANSWER_TIMEOUT:g} s.')
        if again is not None and now - sent > REPEAT_PERIOD:
            futures.append(client.call_async(again))
            sent = now
    response = done[0].result()
    return CallResult(0 if response.success else 1, response.message)


def next_table_state(node: Node) -> TableState | None:
    """The next table state, or None if none comes in time."""
    received: list[TableState] = []
    subscription = node.create_subscription(TableState, 'table_state', received.append, 1)
    deadline = time.monotonic() + DISCOVERY_TIMEOUT
    while not received and time.monotonic() < deadline:
        rclpy.spin_once(node, timeout_sec=POLL_PERIOD)
    node.destroy_subscription(subscription)
    return received[0] if received else None


def domain_of(node: Node) -> int:
    """The ROS domain a node is in."""
    return int(node.context.get_domain_id())

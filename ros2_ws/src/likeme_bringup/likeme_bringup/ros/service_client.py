"""Calling one service of a running cell from a short-lived node, and saying what came of it."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node

from likeme_msgs.msg import TableState

# Seconds to wait for a service or for the first table state: with the start of Python, a caller
# without a cell says so within 10.
PATIENCE = 8.0
# No motion takes longer, s: whoever served it was replaced by another meanwhile.
LONGEST = 180.0
# How often a pending call looks whether its server is still alive, s.
GLANCE = 0.5


class Verdict(NamedTuple):
    """What to tell the caller, and the exit code."""

    code: int
    sentence: str


@contextmanager
def caller(network: bool, domain: int) -> Iterator[Node]:
    """A short-lived node."""
    if network:
        os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'SUBNET'
    rclpy.init(domain_id=domain)
    node = Node(f'caller_{os.getpid()}')
    try:
        yield node
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


def call(node: Node, kind: Any, name: str, request: Any) -> Verdict:
    """Call a service whose answer has `success` and `message`."""
    client = node.create_client(kind, name)
    if not client.wait_for_service(timeout_sec=PATIENCE):
        return Verdict(
            3, f'Nobody serves {name} on ROS domain {domain_of(node)}: is the cell running?'
        )
    future = client.call_async(request)
    try:
        return answer_of(node, client, future)
    except (KeyboardInterrupt, ExternalShutdownException):
        return Verdict(
            130, f'No longer waiting for {name}. What it began goes on; `cell.sh hold` stops it.'
        )


def answer_of(node: Node, client: Any, future: Any) -> Verdict:
    """Wait for an answer as long as there is hope for one."""
    deadline = time.monotonic() + LONGEST
    while not future.done():
        rclpy.spin_until_future_complete(node, future, timeout_sec=GLANCE)
        if not future.done() and not client.service_is_ready():
            return Verdict(3, f'{client.srv_name} went away before it answered.')
        if not future.done() and time.monotonic() > deadline:
            return Verdict(3, f'{client.srv_name} gave no answer within {LONGEST:g} s.')
    answer = future.result()
    return Verdict(0 if answer.success else 1, answer.message)


def next_table_state(node: Node) -> TableState | None:
    """The next table state, or None when none comes in time."""
    seen: list[TableState] = []
    subscription = node.create_subscription(TableState, 'table_state', seen.append, 1)
    deadline = time.monotonic() + PATIENCE
    while not seen and time.monotonic() < deadline:
        rclpy.spin_once(node, timeout_sec=GLANCE)
    node.destroy_subscription(subscription)
    return seen[0] if seen else None


def domain_of(node: Node) -> int:
    """The ROS domain a node is in."""
    return int(node.context.get_domain_id())

"""Awaiting a job of a driver's thread in a callback of the executor's."""

from __future__ import annotations

import concurrent.futures
from typing import Any

from rclpy.node import Node
from rclpy.task import Future


def job_ended(node: Node, job: concurrent.futures.Future[Any]) -> Future:
    """A future of the node's executor that is done when the job is.

    A done Future of rclpy does not wake an executor that waits for events.
    """
    ended = Future()

    def on_done(_: concurrent.futures.Future[Any]) -> None:
        ended.set_result(None)
        if node.executor is not None:
            node.executor.wake()

    job.add_done_callback(on_done)
    return ended

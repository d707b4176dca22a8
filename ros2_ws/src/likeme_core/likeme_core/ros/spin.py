"""Running a node until SIGINT or SIGTERM, and ending it without a traceback."""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable, Sequence

import rclpy
from rclpy.exceptions import ParameterException
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

#: s at most until a signal is noticed.
SIGNAL_PERIOD = 0.2


def run_node(
    name: str,
    create: Callable[[], Node],
    args: Sequence[str] | None = None,
    start_errors: tuple[type[Exception], ...] = (ValueError, TypeError, OSError),
) -> int:
    """Run a node until SIGINT or SIGTERM; the exit code of its process.

    rclpy's own signal handlers shut the context down under whatever is publishing. Here a signal
    is only noted: the callback comes to its end, then node and context are shut down. The handlers
    are installed even where SIGINT was inherited as ignored, as by a script's `&`.

    Args:
        name: of the node, for the sentence that says why it does not start.
        create: makes the node. A node with a method `stop` has it called before the executor
            ends, so that callbacks that wait for its threads can answer.
        args: ROS arguments; the process's own when None.
        start_errors: what `create` may raise for bad parameters, beside ParameterException: one
            sentence and exit code 1.
    """
    signals: list[int] = []
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda received, _: signals.append(received))
    rclpy.init(
        args=None if args is None else list(args), signal_handler_options=SignalHandlerOptions.NO
    )
    try:
        node = create()
    except (*start_errors, ParameterException) as error:
        rclpy.try_shutdown()
        print(f'{name} does not start: {error}', file=sys.stderr)  # noqa: T201
        return 1
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    try:
        while not signals:
            executor.spin_once(timeout_sec=SIGNAL_PERIOD)
    finally:
        stop = getattr(node, 'stop', None)
        if stop is not None:
            stop()
            for _ in range(3):
                executor.spin_once(timeout_sec=0.0)
        executor.shutdown()
        node.destroy_node()
        rclpy.try_shutdown()
    return 0

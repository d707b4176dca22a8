"""Run a node until SIGINT or SIGTERM and shut it down without a traceback."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Sequence

import rclpy
from rclpy.exceptions import ParameterException
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from likeme_core.ros.time import steady_clock

#: Longest time until a signal is noticed, s.
SIGNAL_PERIOD = 0.2
#: s after the start within which a simulated clock must have been heard.
CLOCK_CHECK_DELAY = 5.0


def run_node(
    name: str,
    create: Callable[[], Node],
    args: Sequence[str] | None = None,
    start_errors: tuple[type[Exception], ...] = (ValueError, TypeError, OSError),
) -> int:
    """Run a node until SIGINT or SIGTERM; the exit code for its process.

    rclpy's signal handlers shut the context down while callbacks may still publish. These handlers
    only set a flag: the running callback ends first, then node and context are shut down. They are
    also installed if SIGINT was inherited as ignored, as from a shell script's `&`. A SIGINT that
    was blocked until now ends the node as any other.

    Args:
        name: of the node, for the error message if it does not start.
        create: makes the node. If the node has a method `stop`, it is called before the executor
            is shut down, so that callbacks that wait for its threads can answer.
        args: ROS arguments; None: those of the process.
        start_errors: exceptions of `create` that mean bad parameters, in addition to
            ParameterException: one sentence and exit code EX_CONFIG (78), which tells a
            supervisor that the next start would end in the same way.
    """
    signals: list[int] = []
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda received, _: signals.append(received))
    # Blocked by who started the process, so that none came while modules were imported.
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
    rclpy.init(
        args=None if args is None else list(args), signal_handler_options=SignalHandlerOptions.NO
    )
    errors: tuple[type[Exception], ...] = (*start_errors, ParameterException)
    try:
        node = create()
    except errors as error:
        rclpy.try_shutdown()
        _ignore_signals()
        print(f'{name} does not start: {error}', file=sys.stderr)  # noqa: T201
        return os.EX_CONFIG
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    node.create_timer(CLOCK_CHECK_DELAY, lambda: _check_clock(node), clock=steady_clock())
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
        _ignore_signals()
    return 0


def _ignore_signals() -> None:
    """Keep a second Ctrl-C from killing the interpreter while it ends, when handlers are gone."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)


def _check_clock(node: Node) -> None:
    """Warn if simulated time stands at zero; stamps and steady timers do not depend on it."""
    if node.get_parameter('use_sim_time').value and not node.get_clock().now().nanoseconds:
        node.get_logger().warning(
            'use_sim_time is set, and no /clock is heard: ages in diagnostics are not known.',
            throttle_duration_sec=60.0,
        )

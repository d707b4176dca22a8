"""Run a node until SIGINT or SIGTERM and shut it down without a traceback."""

from __future__ import annotations

import atexit
import os
import signal
import sys
from collections.abc import Callable, Sequence

import rclpy
from rclpy.exceptions import ParameterException
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.signals import SignalHandlerOptions

from likeme_core.ros.time import steady_clock

#: Longest time until a signal is noticed, s.
SIGNAL_PERIOD = 0.2
#: s after the start within which a simulated clock must have been heard.
CLOCK_CHECK_DELAY = 5.0

#: Nodes that hold this process's DDS participant until the process's own node does.
_placeholders: list[Node] = []


def join_graph(args: Sequence[str] | None = None) -> None:
    """Make this process's DDS participant before its node, so that the others know it by then.

    For standby processes: to find the others takes a participant 0.3 to 2.7 s. Until run_node has
    made the node, a hidden node `_standby_PID` holds the participant.

    Args:
        args: ROS arguments; None: those of the process.
    """
    _init(args)
    plain = Parameter('start_type_description_service', value=False)
    _placeholders.append(
        Node(
            f'_standby_{os.getpid()}', use_global_arguments=False, enable_rosout=False,
            start_parameter_services=False, parameter_overrides=[plain],
        )
    )  # fmt: skip
    atexit.register(_leave_graph)


def _leave_graph() -> None:
    _destroy_placeholder()
    rclpy.try_shutdown()


def _destroy_placeholder() -> None:
    if _placeholders:
        _placeholders.pop().destroy_node()


def _init(args: Sequence[str] | None) -> None:
    rclpy.init(
        args=None if args is None else list(args), signal_handler_options=SignalHandlerOptions.NO
    )


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
    if not _placeholders:
        _init(args)
    errors: tuple[type[Exception], ...] = (*start_errors, ParameterException)
    try:
        node = create()
    except errors as error:
        _destroy_placeholder()
        rclpy.try_shutdown()
        _ignore_signals()
        print(f'{name} does not start: {error}', file=sys.stderr)  # noqa: T201
        return os.EX_CONFIG
    _destroy_placeholder()
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

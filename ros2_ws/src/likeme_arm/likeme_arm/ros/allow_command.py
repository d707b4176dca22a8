"""`allow`: asks a person at the terminal for each motion of an arm in step mode."""

from __future__ import annotations

import select
import sys
import time

import rclpy
import typer
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from std_msgs.msg import String
from std_srvs.srv import SetBool

from likeme_core.cli import Domain, Network, set_discovery
from likeme_core.ros.qos import LATCHED
from likeme_core.typer_app import App

#: s to look for an arm in step mode; for it to answer.
DISCOVERY_TIMEOUT, ANSWER_TIMEOUT = 8.0, 5.0
NO_ARM = (
    f'Expected an arm in step mode within {DISCOVERY_TIMEOUT:g} s, heard none: start it '
    'with `start_cell.sh --arm CONFIG --step`.'
)
ANSWERS = {'y': True, 'n': False}


class AllowClient(Node):
    """Hears arm/next_motion and calls arm/allow_motion.

    Attributes:
        motion: what waits to be allowed; empty: nothing.
    """

    def __init__(self) -> None:
        super().__init__('allow', start_parameter_services=False)
        self.motion = ''
        self.create_subscription(String, 'arm/next_motion', self._on_motion, LATCHED)
        self._client = self.create_client(SetBool, 'arm/allow_motion')
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self)

    @property
    def connected(self) -> bool:
        """Whether an arm in step mode is there."""
        return bool(self._client.service_is_ready())

    def spin(self, seconds: float) -> None:
        """Receive messages for a while."""
        self._executor.spin_once(timeout_sec=seconds)

    def answer(self, allowed: bool) -> str:
        """Allow or refuse what waits; what the driver says."""
        future = self._client.call_async(SetBool.Request(data=allowed))
        self._executor.spin_until_future_complete(future, ANSWER_TIMEOUT)
        if not future.done():
            return f'Expected an answer of the arm within {ANSWER_TIMEOUT:g} s, got none.'
        return str(future.result().message)

    def _on_motion(self, message: String) -> None:
        self.motion = message.data


def allow(network: Network = False, domain: Domain = 0) -> None:
    """Ask for each motion of an arm in step mode; Ctrl-C leaves."""
    set_discovery(network)
    rclpy.init(args=[], domain_id=domain, signal_handler_options=SignalHandlerOptions.NO)
    node = AllowClient()
    try:
        code = serve(node)
    except KeyboardInterrupt:
        code = 0
    finally:
        node.destroy_node()
        rclpy.try_shutdown()
    raise typer.Exit(code)


def serve(node: AllowClient) -> int:
    """Ask until the input ends; the exit code."""
    deadline = time.monotonic() + DISCOVERY_TIMEOUT
    while not node.connected:
        node.spin(0.1)
        if time.monotonic() > deadline:
            print(NO_ARM, file=sys.stderr)
            return 3
    print('Each motion is asked for: y lets the arm do it, n ends the request.', flush=True)
    asked = ''
    while True:
        node.spin(0.1)
        if node.motion != asked:
            asked = node.motion
            if asked:
                print(f'{asked}? [y/n] ', end='', flush=True)
        if select.select([sys.stdin], [], [], 0)[0]:
            line = sys.stdin.readline()
            if not line:
                return 0
            if asked and node.motion == asked:
                reply(node, line.strip().lower())
            else:
                print('Nothing is asked: this answer was discarded.', flush=True)


def reply(node: AllowClient, word: str) -> None:
    """Pass an answer on, if there is a question and it is one."""
    if word not in ANSWERS:
        print(f"Expected y or n, got '{word}'.", flush=True)
        return
    # What is typed before the next question is shown does not answer it.
    node.motion = ''
    print(node.answer(ANSWERS[word]), flush=True)


def main() -> None:
    """Entry point of `allow`."""
    app = App(add_completion=False, rich_markup_mode=None)
    app.command()(allow)
    app(prog_name='allow')


if __name__ == '__main__':
    main()

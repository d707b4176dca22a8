"""`stop`: a resident process, connected before it is needed, that stops the cell at one key."""

from __future__ import annotations

import os
import select
import sys
import threading
import time
from collections.abc import Iterator
from typing import Annotated

import rclpy
import typer
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from std_msgs.msg import String

from likeme_core.cli import Domain, Network, set_discovery, user_name
from likeme_core.ros.qos import LATCHED
from likeme_core.terminal import single_keys
from likeme_core.typer_app import App
from likeme_msgs.msg import HoldState

#: s in which the keeper has to confirm a stop.
CONFIRMATION_TIMEOUT = 3.0
#: s between two messages of an unconfirmed stop.
REPEAT_PERIOD = 0.02
#: s to look for a hold keeper before the first prompt.
DISCOVERY_TIMEOUT = 8.0
#: s without its messages after which the keeper counts as gone.
SILENCE = 0.5
END_KEYS = (b'\x03', b'\x04', b'')


class StopNode(Node):
    """Publishes cell/stop and hears cell/hold_state."""

    def __init__(self, name: str = 'stop') -> None:
        """name: of the node, before the number of the process."""
        super().__init__(f'{name}_{os.getpid()}', start_parameter_services=False)
        self._stop_pub = self.create_publisher(String, 'cell/stop', 10)
        self._changed = threading.Condition()
        self._state: HoldState | None = None
        self._heard = 0.0
        self.create_subscription(HoldState, 'cell/hold_state', self._on_state, LATCHED)

    def wait_for_keeper(self, timeout: float) -> bool:
        """Whether the keeper's state arrives, and this node's stop can reach it, in time (s)."""
        deadline = time.monotonic() + timeout
        with self._changed:
            self._changed.wait_for(lambda: self._state is not None, timeout)
        while not self._stop_pub.get_subscription_count() and time.monotonic() < deadline:
            time.sleep(0.05)
        return self.connected

    @property
    def connected(self) -> bool:
        """Whether the keeper is heard and can be reached."""
        heard = self._state is not None and self.keeper_silence < SILENCE
        return heard and self._stop_pub.get_subscription_count() > 0

    @property
    def keeper_silence(self) -> float:
        """Time since the keeper was heard, s."""
        return time.monotonic() - self._heard

    @property
    def held(self) -> bool:
        """Whether the keeper last said that motion is held."""
        return self._state is not None and self._state.held

    @property
    def hold_state(self) -> HoldState | None:
        """What the keeper last said."""
        return self._state

    def send_stop(self, by: str) -> None:
        """Publish one stop and return at once; `stop` sees to it that it arrives."""
        self._stop_pub.publish(String(data=by))

    def stop(self, by: str) -> float | None:
        """Stop the cell; s until the keeper has said so, None if it has not in time."""
        before = 0 if self._state is None else self._state.change
        began = time.monotonic()
        while time.monotonic() - began < CONFIRMATION_TIMEOUT:
            self.send_stop(by)
            with self._changed:
                if self._changed.wait_for(lambda: self._is_held_after(before), REPEAT_PERIOD):
                    return time.monotonic() - began
        return None

    def _is_held_after(self, change: int) -> bool:
        return self._state is not None and self._state.held and self._state.change > change

    def _on_state(self, state: HoldState) -> None:
        with self._changed:
            self._state, self._heard = state, time.monotonic()
            self._changed.notify_all()


def stop(
    by: Annotated[
        str,
        typer.Option(
            '--by', help='Who stops.', default_factory=user_name, show_default='the user name'
        ),
    ],
    network: Network = False,
    domain: Domain = 0,
) -> None:
    """Stop every motion of the cell at a key; Ctrl-C leaves. It stays held until it is resumed."""
    set_discovery(network)
    rclpy.init(args=[], domain_id=domain, signal_handler_options=SignalHandlerOptions.NO)
    node = StopNode()
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    thread = threading.Thread(target=executor.spin, daemon=True)
    thread.start()
    try:
        code = serve_keys(node, by)
    except KeyboardInterrupt:
        code = 0
    finally:
        executor.shutdown()
        thread.join(5.0)
        node.destroy_node()
        rclpy.try_shutdown()
    raise typer.Exit(code)


def serve_keys(node: StopNode, by: str) -> int:
    """Stop at each key until the input ends; the exit code: 3 without a keeper."""
    if not node.wait_for_keeper(DISCOVERY_TIMEOUT):
        print(
            f'Expected a hold keeper within {DISCOVERY_TIMEOUT:g} s, heard none: is the cell '
            'running?',
            file=sys.stderr,
        )
        return 3
    print('The cell is held.' if node.held else 'Motion is allowed.', flush=True)
    print('Any key stops every motion; Ctrl-C leaves.', flush=True)
    for _ in keys():
        if not node.connected:
            print('The hold keeper is not heard: the arm does not move without it.', flush=True)
        delay = node.stop(by)
        if delay is None:
            print(
                f'STOP was sent, and not confirmed within {CONFIRMATION_TIMEOUT:g} s. Use the '
                'hardware stop.',
                flush=True,
            )
        else:
            print(
                f'HELD, confirmed after {delay * 1e3:.0f} ms. `cell.sh resume` allows motion.',
                flush=True,
            )
    return 0


def keys() -> Iterator[bytes]:
    """Each key of the terminal, or each line of another input; a burst of keys counts once."""
    descriptor = sys.stdin.fileno()
    with single_keys(descriptor):
        while True:
            key = os.read(descriptor, 1024)
            if key in END_KEYS:
                return
            yield key
            while select.select([descriptor], [], [], 0)[0] and os.isatty(descriptor):
                if os.read(descriptor, 1024) in END_KEYS:
                    return


def main() -> None:
    """Entry point of `stop`."""
    app = App(add_completion=False, rich_markup_mode=None)
    app.command()(stop)
    app()


if __name__ == '__main__':
    main()

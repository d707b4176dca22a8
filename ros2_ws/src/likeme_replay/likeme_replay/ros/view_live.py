"""`view --live`: the running cell as a scene."""

from __future__ import annotations

import math
import signal
import time
from collections.abc import Callable

from likeme_core.interrupt import deferred_interrupt
from likeme_core.world import World, load_world
from likeme_replay.ros.view_node import ViewNode
from likeme_replay.ros.waiting_node import ReplayFailedError, node_on_domain
from likeme_replay.viewer.live_source import LiveSource
from likeme_replay.viewer.message_scene import MessageScene
from likeme_replay.viewer.scene import Scene

#: s in which a running cell is heard.
FIRST_MESSAGE = 15.0

OpenScene = Callable[[World], Scene]
#: Called between two messages; raises KeyboardInterrupt to end.
Check = Callable[[], None]


def view_live(source: LiveSource, open_scene: OpenScene, check: Check) -> str:
    """Show a cell until SIGINT, SIGTERM or `check` ends it; a sentence on what was shown.

    Args:
        source: the cell.
        open_scene: makes the scene, once the world is known.
        check: called between two messages.

    Raises:
        ReplayFailedError: no cell is heard, or it runs in another world.
        ValueError: there is no such world.
        KeyboardInterrupt: a signal came before the cell was heard.
    """
    with (
        deferred_interrupt(signal.SIGINT, signal.SIGTERM) as interrupted,
        node_on_domain(ViewNode, source.domain, source.network) as node,
    ):

        def check_all() -> None:
            interrupted()
            check()

        messages = MessageScene(*_opened(node, source, open_scene, check_all))
        node.follow(messages.hear)
        end = math.inf if source.seconds is None else time.monotonic() + source.seconds
        try:
            while time.monotonic() < end:
                check_all()
                node.spin(0.1)
                if messages.other_world:
                    raise ReplayFailedError(messages.other_world)
        except KeyboardInterrupt:
            pass
        unreadable = f', {messages.unreadable} could not be read' if messages.unreadable else ''
        return f'{messages.shown} messages shown{unreadable}.'


def _opened(
    node: ViewNode, source: LiveSource, open_scene: OpenScene, check: Check
) -> tuple[Scene, World]:
    """The scene, in the world of the cell."""
    deadline = time.monotonic() + FIRST_MESSAGE
    while not node.world_label:
        check()
        if time.monotonic() > deadline:
            raise ReplayFailedError(
                f'Expected a running cell on ROS domain {source.domain}, heard none in '
                f'{FIRST_MESSAGE:.0f} s; start_cell.sh starts one.'
            )
        node.spin(0.1)
    used = load_world(source.world or node.world_label.partition('@')[0])
    try:
        used.check_label(node.world_label)
    except ValueError as error:
        raise ReplayFailedError(f'{error} Name its file by --world.') from None
    return open_scene(used), used

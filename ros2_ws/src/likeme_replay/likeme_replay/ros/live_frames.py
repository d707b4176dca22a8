"""Frames of a running camera, for a command line."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from likeme_core.interrupt import deferred_interrupt
from likeme_perception.rgbd import Intrinsics, RgbdFrame
from likeme_replay.ros.frames_node import FramesNode
from likeme_replay.ros.waiting_node import ReplayFailedError, node_on_domain

#: s within which frames of a running camera come.
FIRST_FRAMES = 10.0


class LiveFrames:
    """Takes frames from the topics of a camera, some at a time."""

    def __init__(self, node: FramesNode, domain: int, check: Callable[[], None]) -> None:
        self._node, self._domain, self._check = node, domain, check

    def take(self, count: int) -> tuple[list[RgbdFrame], Intrinsics]:
        """The next frames.

        Raises:
            ReplayFailedError: they do not come.
            KeyboardInterrupt: by SIGINT or SIGTERM.
        """
        self._node.frames.clear()
        deadline = time.monotonic() + FIRST_FRAMES + count
        while len(self._node.frames) < count or self._node.intrinsics is None:
            self._check()
            if time.monotonic() > deadline:
                raise ReplayFailedError(
                    f'Expected {count} frames on ROS domain {self._domain}, got '
                    f'{len(self._node.frames)}; not received: {self._node.missing}.'
                )
            self._node.spin(0.1)
        return list(self._node.frames)[-count:], self._node.intrinsics


@contextmanager
def live_frames(domain: int, network: bool, keep: int) -> Iterator[LiveFrames]:
    """The frames of the camera on a ROS domain."""
    with (
        deferred_interrupt(signal.SIGINT, signal.SIGTERM) as check,
        node_on_domain(lambda: FramesNode(keep), domain, network) as node,
    ):
        yield LiveFrames(node, domain, check)

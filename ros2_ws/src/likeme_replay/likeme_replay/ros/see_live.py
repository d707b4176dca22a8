"""`see --live`: pictures that a running perception_node draws."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable
from pathlib import Path

from likeme_bags.videos import Video
from likeme_core.interrupt import deferred_interrupt
from likeme_perception.image_pairs import write_image
from likeme_replay.ros.overlay_node import OverlayNode
from likeme_replay.ros.waiting_node import ReplayFailedError, node_on_domain

#: s for a first picture to come. A cell that starts needs most of them.
FIRST_PICTURE = 15.0
#: Pictures a second of table_overlay.
RATE = 2.0


def see_live(out: Path, seconds: float | None, domain: int, network: bool) -> str:
    """Write the next picture, or a video of some s; a sentence on what was written.

    seconds: length of a video; None: until SIGINT or SIGTERM.

    Raises:
        ReplayFailedError: no picture came.
        KeyboardInterrupt: a signal came before the first picture.
    """
    with (
        deferred_interrupt(signal.SIGINT, signal.SIGTERM) as check,
        node_on_domain(OverlayNode, domain, network) as node,
    ):
        _wait_for_picture(node, domain, check)
        if out.suffix == '.mp4':
            return f'Written: {out}, {_record(node, out, seconds, check)} pictures.'
        picture = node.picture
        assert picture is not None
        write_image(out, picture)
        return f'Written: {out}'


def _wait_for_picture(node: OverlayNode, domain: int, check: Callable[[], None]) -> None:
    deadline = time.monotonic() + FIRST_PICTURE
    while not node.count:
        check()
        if time.monotonic() > deadline:
            raise ReplayFailedError(_nothing_came(node.said, domain))
        node.spin(0.1)


def _nothing_came(said: str | None, domain: int) -> str:
    start = f'Expected a picture on table_overlay within {FIRST_PICTURE:.0f} s, got none'
    if said is None:
        return (
            f'{start}: no perception_node is heard on ROS domain {domain}; start_cell.sh starts '
            'one.'
        )
    return f'{start}: perception_node says: {said or "ready"}.'


def _record(node: OverlayNode, out: Path, seconds: float | None, check: Callable[[], None]) -> int:
    """Write pictures as they come; how many."""
    end = None if seconds is None else time.monotonic() + seconds
    written, seen = 0, 0
    with Video(out, RATE) as video:
        try:
            while end is None or time.monotonic() < end:
                check()
                picture = node.picture
                if node.count > seen and picture is not None:
                    video.write(picture)
                    written, seen = written + 1, node.count
                node.spin(0.1)
        except KeyboardInterrupt:
            pass
    return written

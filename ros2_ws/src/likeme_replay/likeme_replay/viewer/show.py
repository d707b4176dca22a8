"""What `view` does with a recording, with a saved scene, and with the running cell."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable
from math import inf
from pathlib import Path

from rich.console import Console

from likeme_bags.errors import BagError
from likeme_bags.reading import open_bag
from likeme_core.interrupt import deferred_interrupt
from likeme_core.progress_bar import ProgressBar, StatusLine
from likeme_core.stamps import SECOND
from likeme_core.world import load_world
from likeme_replay import recorded_parameters
from likeme_replay.viewer.display import Display, display, wait_until_closed
from likeme_replay.viewer.live_source import LiveSource
from likeme_replay.viewer.recorded_scene import settings_of, show_bag
from likeme_replay.viewer.viewer_process import PortError, Viewer, ViewerError, viewer

DONE, FAILED, NO_CELL, ENDED = 0, 1, 3, 130
_SIGNALS = (signal.SIGINT, signal.SIGTERM)


def show_recording(path: Path, save: Path | None, web_port: int | None, world: str | None) -> int:
    """Show or write a bag; the exit code. web_port: None: no page for a browser."""
    return _code_of(lambda: _show_recording(path, save, web_port, world))


def show_saved(path: Path, web_port: int | None) -> int:
    """Show a file that was written; the exit code."""
    return _code_of(lambda: _show_saved(path, web_port))


def show_live(source: LiveSource, save: Path | None, web_port: int | None) -> int:
    """Show or write the running cell until Ctrl-C; the exit code."""
    # Imported here: recordings need no ROS.
    from likeme_replay.ros.view_live import view_live
    from likeme_replay.ros.waiting_node import ReplayFailedError

    def run() -> None:
        with display(save, web_port) as opened:
            _say_where(opened.shown)
            line = StatusLine('Live', source.seconds)
            check = _checks_and_tells(opened, line, save)
            with line.shown():
                told = view_live(source, opened.open_scene, check)
            print(told)
            _say_written(save)

    try:
        return _code_of(run)
    except ReplayFailedError as error:
        return _complain(str(error), NO_CELL)


def _show_recording(
    path: Path, save: Path | None, web_port: int | None, world: str | None
) -> None:
    with (
        open_bag(path) as bag,
        deferred_interrupt(*_SIGNALS) as interrupted,
        display(save, web_port) as opened,
    ):
        parameters = settings_of(bag, world)
        used = load_world(recorded_parameters.world_of(*parameters.values()))
        _say_where(opened.shown)
        total = (bag.end - bag.start) // SECOND
        bar = ProgressBar(Console(stderr=True), 's of the recording', total, 0, inf)

        def progress(stamp: int) -> None:
            interrupted()
            opened.check()
            bar.reach((stamp - bag.start) // SECOND)

        with bar.shown():
            shown = show_bag(bag, parameters, used, opened.open_scene(used), progress)
        print(shown)
        for sentence in bag.warnings:
            print(f'view: {sentence}', file=sys.stderr)
        opened.wait(interrupted)
    _say_written(save)


def _show_saved(path: Path, web_port: int | None) -> None:
    if not path.is_file():
        raise FileNotFoundError(f'Expected a file, got {path}, which does not exist.')
    with deferred_interrupt(*_SIGNALS) as interrupted, viewer(web_port, path) as shown:
        _say_where(shown)
        wait_until_closed(shown, interrupted)


def _checks_and_tells(opened: Display, line: StatusLine, save: Path | None) -> Callable[[], None]:
    """The check of a display, which also says how much is written."""

    def check() -> None:
        opened.check()
        written = save is not None and save.exists()
        line.say(f'{save.stat().st_size / 1e6:.1f} MB' if save and written else 'shown')

    return check


def _code_of(run: Callable[[], None]) -> int:
    """Run; errors in one sentence, and the exit code for them."""
    try:
        run()
    except PortError as error:
        return _complain(str(error), os.EX_CONFIG)
    except (ViewerError, BagError, ValueError, OSError) as error:
        return _complain(str(error), FAILED)
    except KeyboardInterrupt:
        return _complain('ended.', ENDED)
    return DONE


def _complain(sentence: str, code: int) -> int:
    print(f'view: {" ".join(sentence.split())}', file=sys.stderr)
    return code


def _say_where(shown: Viewer | None) -> None:
    if shown is not None:
        where = f'The viewer: {shown.page}' if shown.page else 'The viewer has its own window.'
        print(f'{where}  Ctrl-C ends.', flush=True)


def _say_written(save: Path | None) -> None:
    if save is not None:
        print(f'Written: {save}, {save.stat().st_size / 1e6:.1f} MB')

"""Where a scene goes: a file, a window, a page for a browser."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from datetime import timedelta
from pathlib import Path

import rerun as rr

from likeme_core.world import World
from likeme_replay.viewer.scene import Scene, layout
from likeme_replay.viewer.viewer_process import Viewer, viewer

_APPLICATION = 'likeme'
#: Between two writes of what is not much: the index of all writes is kept in memory.
_FILE_PERIOD = timedelta(seconds=5)
#: s between two looks at whether the viewer was closed.
_PERIOD = 0.2


class Display:
    """One recording with its sinks.

    Attributes:
        shown: the viewer; None: only a file is written.
    """

    def __init__(self, save: Path | None, shown: Viewer | None) -> None:
        self.shown = shown
        batches = rr.ChunkBatcherConfig.DEFAULT()
        if shown is None:
            batches.flush_tick = _FILE_PERIOD
        self._recording = rr.RecordingStream(_APPLICATION, batcher_config=batches)
        self._sinks = [] if save is None else [rr.FileSink(str(save))]
        if shown is not None:
            self._sinks.append(rr.GrpcSink(shown.url))

    def open_scene(self, world: World) -> Scene:
        """The scene, laid out for a world; called once."""
        self._recording.set_sinks(*self._sinks, default_blueprint=layout(world))
        return Scene(self._recording, world)

    def check(self) -> None:
        """Raise KeyboardInterrupt if the viewer was closed."""
        if self.shown is not None:
            self.shown.check()

    def wait(self, check: Callable[[], None]) -> None:
        """Until the viewer is closed; check: raises KeyboardInterrupt on a signal."""
        self._recording.flush()
        wait_until_closed(self.shown, check)

    def close(self) -> None:
        """Send and write what is left."""
        self._recording.flush()
        self._recording.disconnect()


def wait_until_closed(shown: Viewer | None, check: Callable[[], None]) -> None:
    """Return when a viewer was closed, or when `check` raises KeyboardInterrupt."""
    try:
        while shown is not None:
            check()
            shown.check()
            time.sleep(_PERIOD)
    except KeyboardInterrupt:
        return


@contextmanager
def display(save: Path | None, web_port: int | None) -> Iterator[Display]:
    """Open a file, a viewer, or both.

    Args:
        save: file to write.
        web_port: of a page for a browser; None: a window, unless a file is written.

    Raises:
        ViewerError: the viewer cannot be shown.
    """
    with ExitStack() as stack:
        wanted = save is None or web_port is not None
        opened = Display(save, stack.enter_context(viewer(web_port)) if wanted else None)
        stack.callback(opened.close)
        yield opened

"""A Rerun recording whose only time is that of the header stamps."""

from __future__ import annotations

from typing import Any

import numpy as np
import rerun as rr

#: Name of the timeline: the header stamps of the camera's frames, of the joints and of the events.
TIMELINE = 'stamp'


class SceneStream:
    """Logs archetypes under entity paths at stamps in ns."""

    def __init__(self, recording: rr.RecordingStream) -> None:
        self.recording = recording
        recording.set_log_tick_enabled(False)
        recording.set_log_time_enabled(False)

    def log(self, stamp: int, path: str, *values: Any) -> None:
        """What an entity is from a stamp on."""
        self.recording.set_time(TIMELINE, timestamp=np.datetime64(stamp, 'ns'))
        self.recording.log(path, *values)

    def log_static(self, path: str, *values: Any) -> None:
        """What an entity is at all times."""
        self.recording.log(path, *values, static=True)


class Pace:
    """Lets something through at most once in a period of stamps (ns)."""

    def __init__(self, period: int) -> None:
        self._period = period
        self._last: int | None = None

    def due(self, stamp: int) -> bool:
        """Whether it is time again; also when time was set back, as by a new cell."""
        last = self._last
        if last is not None and last <= stamp < last + self._period:
            return False
        self._last = stamp
        return True

"""What perception last said, and for how long it is believed."""

from __future__ import annotations

from collections.abc import Mapping

from likeme_arm.motion import ObjectView


class PerceivedObjects:
    """The last table state, by its stamp, ns; what was seen before a reset is not believed."""

    def __init__(self, timeout: float) -> None:
        """timeout: s for which a table state may be acted on."""
        self._timeout = timeout
        self._seen: tuple[int, Mapping[str, ObjectView]] = 0, {}
        self._not_before = 0

    def take(self, stamp: int, views: Mapping[str, ObjectView]) -> None:
        """Take a table state."""
        if stamp > self._not_before:
            self._seen = stamp, views

    def forget(self, now: int) -> None:
        """Believe nothing that was seen up to now."""
        self._not_before, self._seen = now, (self._seen[0], {})

    def look(self, name: str, now: int) -> ObjectView | None:
        """Where an object is, if that is known and recent."""
        return self._seen[1].get(name) if self.age(now) <= self._timeout else None

    def age(self, now: int) -> float:
        """Of the last table state, s; infinite without one."""
        stamp = self._seen[0]
        return (now - stamp) * 1e-9 if stamp else float('inf')

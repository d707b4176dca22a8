"""Objects as perception last reported them, with a limit on their age."""

from __future__ import annotations

from collections.abc import Mapping

from likeme_arm.motion import ObjectView
from likeme_core.stamps import nanoseconds, seconds

#: s by which a camera's clock may be ahead of the driver's.
CLOCK_TOLERANCE = 1.0


class PerceivedObjects:
    """The last table state, by its stamp (ns). States from before a reset are ignored."""

    def __init__(self, timeout: float) -> None:
        """timeout: greatest age of a table state that is acted on, s."""
        self._timeout = timeout
        self._last: tuple[int, Mapping[str, ObjectView]] = 0, {}
        self._not_before = 0

    def update(self, stamp: int, views: Mapping[str, ObjectView], now: int) -> None:
        """Replace the last table state, unless the new one is from before the last `clear`.

        Raises:
            ValueError: it is from the future, and would never be too old.
        """
        if stamp > now + nanoseconds(CLOCK_TOLERANCE):
            raise ValueError(
                f'Expected a table_state from before now, got one from {seconds(stamp - now):.1f} '
                's later: the clocks of camera and arm differ.'
            )
        if stamp > self._not_before:
            self._last = stamp, views

    def clear(self, now: int) -> None:
        """Ignore every table state with a stamp up to now."""
        self._not_before, self._last = now, (self._last[0], {})

    def view(self, name: str, now: int) -> ObjectView | None:
        """The object's last view; None if it was never seen or the table state is too old."""
        return self._last[1].get(name) if self.age(now) <= self._timeout else None

    def others(self, name: str) -> dict[str, ObjectView]:
        """The last views but that of `name`, whatever their age: what to stay clear of."""
        return {other: view for other, view in self._last[1].items() if other != name}

    def age(self, now: int) -> float:
        """Age of the last table state, s; infinite if there is none."""
        stamp = self._last[0]
        return (now - stamp) * 1e-9 if stamp else float('inf')

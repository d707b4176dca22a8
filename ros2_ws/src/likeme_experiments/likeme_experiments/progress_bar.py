"""A progress bar with the time left, or a line now and then where there is no terminal."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)


class ProgressBar:
    """Counts finished items.

    Attributes:
        made: items finished since this run began.
    """

    def __init__(
        self, console: Console, what: str, total: int | None, done: int, line_period: float
    ) -> None:
        """total: items in all, if known; done: before this run; line_period: s between lines."""
        self.made = 0
        self._console, self._total, self._done = console, total, done
        self._line_period = line_period
        self._began = self._last_line = time.monotonic()
        self._bars = Progress(
            TextColumn('{task.description}'), BarColumn(), MofNCompleteColumn(),
            TimeElapsedColumn(), TextColumn('left'), TimeRemainingColumn(),
            console=console, disable=not console.is_terminal,
        )  # fmt: skip
        self._bar = self._bars.add_task(what, total=total, completed=done)

    @contextmanager
    def shown(self) -> Iterator[None]:
        """Show the bar."""
        self._began = self._last_line = time.monotonic()
        with self._bars:
            yield

    def advance(self, so_far: str, description: str | None = None) -> None:
        """Count one item. so_far: how a line begins; description: the bar's new description."""
        self.made += 1
        self._bars.update(self._bar, advance=1, description=description)
        now = time.monotonic()
        if not self._console.is_terminal and now - self._last_line >= self._line_period:
            self._last_line = now
            self._console.print(f'{so_far}; {self._left()}', highlight=False)

    def rate(self) -> float:
        """Items of this run per s."""
        return self.made / max(time.monotonic() - self._began, 1e-9)

    def _left(self) -> str:
        if self._total is None:
            return f'{self.rate():.1f} a second'
        return f'about {(self._total - self._done - self.made) / self.rate():.0f} s left'

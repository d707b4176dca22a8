"""Progress on a terminal: a bar with the time left, or a line of what has come so far."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from math import inf
from typing import TypeVar

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

Item = TypeVar('Item')

#: s between two drawings of a bar that has no thread.
DRAW_PERIOD = 0.5


class ProgressBar:
    """Counts finished items.

    Attributes:
        made: items finished since this run began.
    """

    def __init__(
        self,
        console: Console,
        what: str,
        total: int | None,
        done: int,
        line_period: float,
        timed: bool = False,
    ) -> None:
        """Prepare it.

        Args:
            console: where it is shown, if that is a terminal.
            what: the items' name.
            total: items in all, if known.
            done: before this run.
            line_period: s between lines.
            timed: this process measures how long an item takes: no thread draws meanwhile.
        """
        self.made = 0
        self._console, self._total, self._done = console, total, done
        self._line_period, self._timed = line_period, timed
        self._began = self._last_line = self._last_drawn = time.monotonic()
        self._bars = Progress(
            TextColumn('{task.description}'), BarColumn(), MofNCompleteColumn(),
            TimeElapsedColumn(), TextColumn('left'), TimeRemainingColumn(),
            console=console, disable=not console.is_terminal, auto_refresh=not timed,
        )  # fmt: skip
        self._bar = self._bars.add_task(what, total=total, completed=done)

    @contextmanager
    def shown(self) -> Iterator[None]:
        """Show the bar."""
        self._began = self._last_line = time.monotonic()
        with self._bars:
            yield

    @contextmanager
    def paused(self) -> Iterator[None]:
        """Draw nothing meanwhile, e.g. as a person types."""
        self._bars.stop()
        try:
            yield
        finally:
            self._bars.start()

    def advance(self, so_far: str, description: str | None = None) -> None:
        """Count one item. so_far: how a line begins; description: the bar's new description."""
        self.made += 1
        self._bars.update(self._bar, advance=1, description=description)
        self._draw()
        now = time.monotonic()
        if not self._console.is_terminal and now - self._last_line >= self._line_period:
            self._last_line = now
            self._console.print(f'{so_far}; {self._left()}', highlight=False)

    def reach(self, done: int) -> None:
        """Have so many items finished in all, if they are more than before."""
        if done > self._done + self.made:
            self.made = done - self._done
            self._bars.update(self._bar, completed=done)
            self._draw()

    def rate(self) -> float:
        """Items of this run per s."""
        return self.made / max(time.monotonic() - self._began, 1e-9)

    def _draw(self) -> None:
        if self._timed and time.monotonic() - self._last_drawn >= DRAW_PERIOD:
            self._bars.refresh()
            self._last_drawn = time.monotonic()

    def _left(self) -> str:
        if self._total is None:
            return f'{self.rate():.1f} a second'
        return f'about {(self._total - self._done - self.made) / self.rate():.0f} s left'


def counted(items: Iterable[Item], what: str, total: int, timed: bool = False) -> Iterator[Item]:
    """The items, with a bar on a terminal's stderr while they are used; nothing elsewhere.

    timed: see ProgressBar.
    """
    bar = ProgressBar(Console(stderr=True), what, total, 0, inf, timed)
    with bar.shown():
        for item in items:
            yield item
            bar.advance('')


class StatusLine:
    """One line on a terminal's stderr that is drawn anew; nothing where there is none."""

    def __init__(self, what: str, seconds: float | None = None) -> None:
        """what: that goes on; seconds: how long, if known."""
        self._what = what
        console = Console(stderr=True)
        columns = (TextColumn('{task.description}'), TimeElapsedColumn())
        left = (BarColumn(), TextColumn('left'), TimeRemainingColumn())
        self._line = Progress(
            *columns, *(() if seconds is None else left),
            console=console, disable=not console.is_terminal, transient=True,
        )  # fmt: skip
        self._task = self._line.add_task(what, total=seconds)
        self._began = time.monotonic()

    @contextmanager
    def shown(self) -> Iterator[None]:
        """Show the line; it is gone at the end."""
        self._began = time.monotonic()
        with self._line:
            yield

    def say(self, so_far: str) -> None:
        """Show what has come so far."""
        gone = time.monotonic() - self._began
        self._line.update(self._task, description=f'{self._what}: {so_far}', completed=gone)

"""How far a long work is: a bar with the time left, or a line now and then without a terminal."""

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


class TimeLeft:
    """Counts pieces of work as they are made.

    Attributes:
        made: pieces since the beginning of this run.
    """

    def __init__(
        self, console: Console, what: str, total: int | None, done: int, every: float
    ) -> None:
        """total: pieces in all, if known; done: before this run; every: s between lines."""
        self.made = 0
        self._console, self._total, self._done, self._every = console, total, done, every
        self._began = self._told = time.monotonic()
        self._bars = Progress(
            TextColumn('{task.description}'), BarColumn(), MofNCompleteColumn(),
            TimeElapsedColumn(), TextColumn('left'), TimeRemainingColumn(),
            console=console, disable=not console.is_terminal,
        )  # fmt: skip
        self._bar = self._bars.add_task(what, total=total, completed=done)

    @contextmanager
    def shown(self) -> Iterator[None]:
        """Show the bar."""
        self._began = self._told = time.monotonic()
        with self._bars:
            yield

    def one_more(self, so_far: str, latest: str | None = None) -> None:
        """A piece more. so_far: how a line begins; latest: what the bar is called from now on."""
        self.made += 1
        self._bars.update(self._bar, advance=1, description=latest)
        now = time.monotonic()
        if not self._console.is_terminal and now - self._told >= self._every:
            self._told = now
            self._console.print(f'{so_far}; {self._left()}', highlight=False)

    def rate(self) -> float:
        """Pieces of this run per s."""
        return self.made / max(time.monotonic() - self._began, 1e-9)

    def _left(self) -> str:
        if self._total is None:
            return f'{self.rate():.1f} a second'
        return f'about {(self._total - self._done - self.made) / self.rate():.0f} s left'

"""What a learner tells people while it works: a bar with the time left, or now and then a line."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.progress import (
    Progress as Bars,
)

from likeme_inference.experience.campaign import Progress
from likeme_inference.experience.trial import Trial

#: s between lines where there is no terminal.
EVERY = 10.0


class Telling:
    """Tells of trials as they come, and keeps count of those that this run made.

    Attributes:
        made: trials of this run.
    """

    def __init__(self, progress: Progress, console: Console) -> None:
        self._progress, self._console = progress, console
        self.made, self._began = 0, time.monotonic()
        self._told = self._began
        self._bars = Bars(
            TextColumn('{task.description}'), BarColumn(), MofNCompleteColumn(),
            TimeElapsedColumn(), TextColumn('left'), TimeRemainingColumn(),
            console=console, disable=not console.is_terminal,
        )  # fmt: skip
        self._bar = self._bars.add_task('trials', total=progress.total, completed=progress.done)

    @contextmanager
    def shown(self) -> Iterator[None]:
        """Show the bar."""
        self._began = self._told = time.monotonic()
        with self._bars:
            yield

    def trial(self, trial: Trial) -> None:
        """One trial more."""
        self.made += 1
        self._bars.update(self._bar, advance=1, description=sentence(trial))
        now = time.monotonic()
        if not self._console.is_terminal and now - self._told >= EVERY:
            self._told = now
            self._console.print(f'{self.so_far()}; {self._left(now)}', highlight=False)

    def say(self, text: str) -> None:
        """A sentence between the bars."""
        self._console.print(text, highlight=False, markup=False, soft_wrap=True)

    def so_far(self) -> str:
        """How many trials are recorded."""
        total = self._progress.total
        of_all = '' if total is None else f'of {total} '
        return f'{self._progress.done} {of_all}trials recorded'

    def in_the_end(self, place: str) -> str:
        """How many are recorded where, and how many of them by this run."""
        made = f'{self.made} of them now, {self.rate():.2g} a second'
        return f'{self.so_far()} in {place}, {made if self.made else "none of them now"}.'

    def rate(self) -> float:
        """Trials of this run per s."""
        return self.made / max(time.monotonic() - self._began, 1e-9)

    def _left(self, now: float) -> str:
        total = self._progress.total
        if total is None:
            return f'{self.rate():.1f} a second'
        left = (total - self._progress.done) * (now - self._began) / self.made
        return f'about {left:.0f} s left'


def sentence(trial: Trial) -> str:
    """A trial in short."""
    pair = trial.key.pair
    return f'{pair.object} {pair.x_i.name} {pair.action.name}: {trial.x_f.name}'

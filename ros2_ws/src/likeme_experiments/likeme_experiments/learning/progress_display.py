"""What a learner tells people while it works: a bar with the time left, or now and then a line."""

from __future__ import annotations

from contextlib import AbstractContextManager

from rich.console import Console

from likeme_experiments.time_left import TimeLeft
from likeme_inference.experience.campaign import Progress
from likeme_inference.experience.trial import Trial

#: s between lines where there is no terminal.
EVERY = 10.0


class Telling:
    """Tells of trials as they come, and of how many are recorded."""

    def __init__(self, progress: Progress, console: Console) -> None:
        self._progress, self._console = progress, console
        self._bar = TimeLeft(console, 'trials', progress.total, progress.done, EVERY)

    def shown(self) -> AbstractContextManager[None]:
        """Show the bar."""
        return self._bar.shown()

    def trial(self, trial: Trial) -> None:
        """One trial more, that is recorded."""
        self._bar.one_more(self.so_far(), sentence(trial))

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
        bar = self._bar
        made = f'{bar.made} of them now, {bar.rate():.2g} a second'
        return f'{self.so_far()} in {place}, {made if bar.made else "none of them now"}.'


def sentence(trial: Trial) -> str:
    """A trial in short."""
    pair = trial.key.pair
    return f'{pair.object} {pair.x_i.name} {pair.action.name}: {trial.x_f.name}'

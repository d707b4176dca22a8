"""Progress of a campaign on the console: a bar with the time left, or a line now and then."""

from __future__ import annotations

from contextlib import AbstractContextManager

from rich.console import Console

from likeme_core.progress_bar import ProgressBar
from likeme_inference.experience.campaign import Progress
from likeme_inference.experience.trial import Trial

#: s between lines where there is no terminal.
LINE_PERIOD = 10.0


class TrialReporter:
    """Reports recorded trials."""

    def __init__(self, progress: Progress, console: Console) -> None:
        self._progress, self._console = progress, console
        self._bar = ProgressBar(console, 'trials', progress.total, progress.done, LINE_PERIOD)

    def shown(self) -> AbstractContextManager[None]:
        """Show the bar."""
        return self._bar.shown()

    def paused(self) -> AbstractContextManager[None]:
        """Leave the terminal to a question, which a bell announces."""
        if self._console.is_terminal:
            self._console.bell()
        return self._bar.paused()

    def report(self, trial: Trial, planned: bool = True) -> None:
        """Show how a recorded trial ended, and count it if it was planned."""
        pair = trial.key.pair
        latest = f'{pair.object} {pair.x_i.name} {pair.action.name}: {trial.x_f.name}'
        if planned:
            self._bar.advance(self._recorded(), latest)

    def print(self, text: str) -> None:
        """Print a sentence above the bar."""
        self._console.print(text, highlight=False, markup=False, soft_wrap=True)

    def summary(self, place: str) -> str:
        """How many trials are recorded where, and how many of them by this run."""
        bar = self._bar
        made = f'{bar.made} of them now, {bar.rate():.2g} a second'
        return f'{self._recorded()} in {place}, {made if bar.made else "none of them now"}.'

    def _recorded(self) -> str:
        total = self._progress.total
        of_all = '' if total is None else f'of {total} '
        return f'{self._progress.done} {of_all}trials recorded'

"""All episodes in some processes, with the time left, from where the last run stopped."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from itertools import islice

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from likeme_bringup.imitating.episodes import Task, make_episode
from likeme_bringup.imitating.journal import Journal
from likeme_bringup.learning.offline import Crew, local_crew
from likeme_inference.experiments.episode import Episode

#: s between lines where there is no terminal.
EVERY = 20.0


def episodes(
    wanted: Sequence[Task], model_text: str, journal: Journal, workers: int, console: Console
) -> list[Episode]:
    """Every wanted episode, made where the journal has it not; in the order of `wanted`.

    Raises:
        EpisodeFailedError: one cannot be made; what was made is kept.
        ChildProcessError: a process died; what was made is kept.
        OSError: an episode cannot be kept.
    """
    missing = [task for task in wanted if task not in journal.episodes]
    if missing:
        try:
            with local_crew(workers) as crew, _telling(len(wanted), len(missing), console) as told:
                for made in _made(crew, missing, model_text):
                    journal.add(made)
                    told.one_more()
        except BrokenProcessPool:
            raise ChildProcessError(
                'A process that makes episodes died. The same command goes on from here.'
            ) from None
        except KeyboardInterrupt:
            console.print('Stopped. The same command goes on from here.')
            raise
    return [journal.episodes[task] for task in wanted]


def _made(crew: Crew, missing: Sequence[Task], model_text: str) -> Iterator[Episode]:
    """Episodes as they come.

    Each process has one at a time: what was handed out ahead could not be called back by Ctrl-C.
    """
    tasks, running = iter(missing), set[Future[Episode]]()
    while True:
        for task in islice(tasks, crew.size - len(running)):
            running.add(crew.executor.submit(make_episode, task, model_text))
        if not running:
            return
        done, running = wait(running, return_when=FIRST_COMPLETED)
        for future in done:
            yield future.result()


class _Telling:
    """A bar with the time left, or now and then a line."""

    def __init__(self, wanted: int, missing: int, console: Console) -> None:
        self._wanted, self._missing, self._made = wanted, missing, 0
        self._console = console
        self._began = self._told = time.monotonic()
        self.bars = Progress(
            TextColumn('episodes'), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(),
            TextColumn('left'), TimeRemainingColumn(), console=console,
            disable=not console.is_terminal,
        )  # fmt: skip
        self._bar = self.bars.add_task('', total=wanted, completed=wanted - missing)

    def one_more(self) -> None:
        """An episode more."""
        self._made += 1
        self.bars.update(self._bar, advance=1)
        now = time.monotonic()
        if not self._console.is_terminal and now - self._told >= EVERY:
            self._told = now
            left = (self._missing - self._made) * (now - self._began) / self._made
            done = self._wanted - self._missing + self._made
            self._console.print(
                f'{done} of {self._wanted} episodes; about {left:.0f} s left', highlight=False
            )


@contextmanager
def _telling(wanted: int, missing: int, console: Console) -> Iterator[_Telling]:
    telling = _Telling(wanted, missing, console)
    with telling.bars:
        yield telling

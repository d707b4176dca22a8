"""All episodes in some processes, with the time left, from where the last run stopped."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool
from itertools import islice

from rich.console import Console

from likeme_experiments.evaluation.episode import Episode
from likeme_experiments.imitation.episode_log import Journal
from likeme_experiments.imitation.episodes import Task, make_episode
from likeme_experiments.learning.offline import Crew, local_crew
from likeme_experiments.time_left import TimeLeft

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
            done = len(wanted) - len(missing)
            bar = TimeLeft(console, 'episodes', len(wanted), done, EVERY)
            with local_crew(workers) as crew, bar.shown():
                for number, made in enumerate(_made(crew, missing, model_text), done + 1):
                    journal.add(made)
                    bar.one_more(f'{number} of {len(wanted)} episodes')
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

"""Makes episodes in several processes; a stopped run continues from the log."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool
from itertools import islice

from rich.console import Console

from likeme_core.progress_bar import ProgressBar
from likeme_core.world import World
from likeme_experiments.evaluation.episode import ImitationEpisode
from likeme_experiments.imitation.episode_log import EpisodeLog
from likeme_experiments.imitation.episodes import EpisodeTask, make_episode
from likeme_experiments.learning.offline import WorkerPool, local_pool

#: s between lines where there is no terminal.
LINE_PERIOD = 20.0


def episodes(
    world: World,
    wanted: Sequence[EpisodeTask],
    model_text: str,
    log: EpisodeLog,
    workers: int,
    console: Console,
    together: bool = False,
) -> list[ImitationEpisode]:
    """The wanted episodes, in this order; those that are not in the log are made and added.

    Raises:
        EpisodeFailedError: one cannot be made; the others are in the log.
        ChildProcessError: a process died; finished episodes are in the log.
        OSError: an episode cannot be written.
    """
    missing = [task for task in wanted if task not in log.episodes]
    if missing:
        try:
            done = len(wanted) - len(missing)
            bar = ProgressBar(console, 'episodes', len(wanted), done, LINE_PERIOD)
            with local_pool(workers) as pool, bar.shown():
                for number, made in enumerate(
                    _made(pool, missing, model_text, world.source, together), done + 1
                ):
                    log.add(made)
                    bar.advance(f'{number} of {len(wanted)} episodes')
        except BrokenProcessPool:
            raise ChildProcessError(
                'A worker process died. The same command continues from here.'
            ) from None
        except KeyboardInterrupt:
            console.print('Stopped. The same command continues from here.')
            raise
    return [log.episodes[task] for task in wanted]


def _made(
    pool: WorkerPool,
    missing: Sequence[EpisodeTask],
    model_text: str,
    source: str,
    together: bool,
) -> Iterator[ImitationEpisode]:
    """Episodes in the order they are finished.

    Each process has one task at a time: queued ones could not be cancelled on Ctrl-C.
    """
    tasks, running = iter(missing), set[Future[ImitationEpisode]]()
    while True:
        for task in islice(tasks, pool.size - len(running)):
            running.add(pool.executor.submit(make_episode, task, model_text, source, together))
        if not running:
            return
        done, running = wait(running, return_when=FIRST_COMPLETED)
        for future in done:
            yield future.result()

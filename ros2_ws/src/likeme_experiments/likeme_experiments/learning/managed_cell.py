"""A cell of the learner's own: started with it, ended with it, and started anew when it dies."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from likeme_core.processes import interrupt, start

#: s a cell has to end in.
GRACE = 20.0
#: Starts one after another without a trial between.
STARTS = 5


class CellDiesError(Exception):
    """The cell ended again and again: its last words."""


class OwnCell:
    """Runs `start_cell` in a process; `ensure` before each trial, `worked` after it."""

    def __init__(
        self, domain: int, real_time_factor: float, log: Path, say: Callable[[str], None]
    ) -> None:
        self._command = [
            sys.executable, '-m', 'likeme_bringup.start_cell', '--domain', str(domain),
            '--real-time-factor', str(real_time_factor),
        ]  # fmt: skip
        self._log, self._say = log, say
        self._process: subprocess.Popen[bytes] | None = None
        self._starts = 0

    def ensure(self) -> bool:
        """Start the cell unless it runs; whether it had to be started.

        Raises:
            CellDiesError: it did not live long enough for a trial, several times.
        """
        if self._process is not None and self._process.poll() is None:
            return False
        if self._process is not None:
            self._say(f'The cell ended ({self._last_words()}).')
        if self._starts >= STARTS:
            raise CellDiesError(
                f'The cell ended {STARTS} times without a trial. Its last words, from '
                f'{self._log}: {self._last_words()}'
            )
        self._starts += 1
        with self._log.open('ab') as out:
            self._process = start(self._command, out)
        return True

    def worked(self) -> None:
        """Take note that a trial was made."""
        self._starts = 0

    def stop(self) -> None:
        """End it."""
        if self._process is None or self._process.poll() is not None:
            return
        interrupt(self._process, GRACE)

    def _last_words(self) -> str:
        lines = self._log.read_text(encoding='utf-8', errors='replace').strip().splitlines()
        ended = [line for line in lines if ' ended' in line]
        return (ended or lines or ['it said nothing'])[-1]


@contextmanager
def own_cell(
    domain: int, real_time_factor: float, log: Path, say: Callable[[str], None]
) -> Iterator[OwnCell]:
    """A cell of one's own that ends at the end.

    real_time_factor: simulated s per s while it moves; 0: as fast as it goes.
    """
    log.parent.mkdir(parents=True, exist_ok=True)
    log.write_bytes(b'')
    cell = OwnCell(domain, real_time_factor, log, say)
    try:
        yield cell
    finally:
        cell.stop()

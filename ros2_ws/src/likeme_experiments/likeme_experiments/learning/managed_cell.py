"""A cell process started by the learner: restarted when it ends, stopped with the learner."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from likeme_core.processes import interrupt, start
from likeme_core.world import World

#: s after SIGINT before SIGKILL.
SHUTDOWN_TIMEOUT = 20.0
#: Starts in a row without a trial between them.
MAX_STARTS = 5


class CellCrashedError(Exception):
    """The cell ended MAX_STARTS times without a trial; its exit code and last line."""


class ManagedCell:
    """Runs `start_cell` as a process: call `ensure_running` before each trial."""

    def __init__(
        self,
        world: World,
        domain: int,
        real_time_factor: float,
        log: Path,
        report: Callable[[str], None],
        parts: Sequence[str] = (),
    ) -> None:
        self._command = [
            sys.executable, '-m', 'likeme_bringup.start_cell', '--domain', str(domain),
            '--real-time-factor', str(real_time_factor), '--world', world.source, '--no-respawn',
            *(word for part in parts for word in ('--only', part)),
        ]  # fmt: skip
        self._log, self._report = log, report
        self._process: subprocess.Popen[bytes] | None = None
        self._starts = 0

    def ensure_running(self) -> bool:
        """Start the cell unless it runs; True if it had to be started.

        Raises:
            CellCrashedError: it was started MAX_STARTS times without a trial.
        """
        code = None if self._process is None else self._process.poll()
        if self._process is not None and code is None:
            return False
        if code is not None:
            self._report(f'The cell ended with exit code {code}: {self._last_line()}')
        if self._starts >= MAX_STARTS:
            raise CellCrashedError(
                f'The cell ended {MAX_STARTS} times without a trial, the last time with exit '
                f'code {code}: {self._last_line()} All output: {self._log}'
            )
        self._starts += 1
        with self._log.open('ab') as out:
            self._process = start(self._command, out)
        return True

    def trial_recorded(self) -> None:
        """Reset the count of starts without a trial."""
        self._starts = 0

    def stop(self) -> None:
        """Stop the process if it runs."""
        if self._process is not None and self._process.poll() is None:
            interrupt(self._process, SHUTDOWN_TIMEOUT)

    def _last_line(self) -> str:
        lines = self._log.read_text(encoding='utf-8', errors='replace').strip().splitlines()
        return lines[-1] if lines else '(no output)'


@contextmanager
def managed_cell(
    world: World,
    domain: int,
    real_time_factor: float,
    log: Path,
    report: Callable[[str], None],
    parts: Sequence[str] = (),
) -> Iterator[ManagedCell]:
    """A cell process that is stopped at the end.

    real_time_factor: simulated s per s during motions; 0: as fast as possible.
    parts: of the cell, hold, arm, perception or inference; none: all.
    """
    log.parent.mkdir(parents=True, exist_ok=True)
    log.write_bytes(b'')
    cell = ManagedCell(world, domain, real_time_factor, log, report, parts)
    try:
        yield cell
    finally:
        cell.stop()

"""A managed cell is restarted, and given up by its exit code, whatever it printed."""

from __future__ import annotations

import sys
from pathlib import Path
from subprocess import Popen
from typing import IO

import pytest

from likeme_core.paper_world import WORLD
from likeme_experiments.learning import managed_cell as module
from likeme_experiments.learning.managed_cell import MAX_STARTS, CellCrashedError, ManagedCell

CRASH = 'print("The first act ended well."); print("No camera."); raise SystemExit(3)'


def cell_that_runs(
    code: str, log: Path, reports: list[str], monkeypatch: pytest.MonkeyPatch
) -> ManagedCell:
    """A cell whose process runs Python code and has ended when `start` returns."""
    start = module.start

    def start_and_wait(_: object, out: IO[bytes]) -> Popen[bytes]:
        process = start([sys.executable, '-c', code], out)
        process.wait(30)
        return process

    monkeypatch.setattr(module, 'start', start_and_wait)
    log.touch()
    return ManagedCell(WORLD, 0, 0.0, log, reports.append)


def test_a_cell_that_ends_at_once_is_given_up(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    reports: list[str] = []
    cell = cell_that_runs(CRASH, tmp_path / 'cell.log', reports, monkeypatch)
    for _ in range(MAX_STARTS):
        assert cell.ensure_running()
    with pytest.raises(CellCrashedError, match=r'5 times .* with exit code 3: No camera\.'):
        cell.ensure_running()
    assert reports == ['The cell ended with exit code 3: No camera.'] * MAX_STARTS


def test_a_recorded_trial_resets_the_count(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    cell = cell_that_runs('', tmp_path / 'cell.log', [], monkeypatch)
    for _ in range(2 * MAX_STARTS):
        assert cell.ensure_running()
        cell.trial_recorded()

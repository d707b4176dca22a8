"""One cell in simulated time: its stories, a fault in each, and what went wrong."""

from __future__ import annotations

import shutil
import tempfile
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from faults_parts import sim_node
from faults_parts.sim_time import SIM_TIME

# Nodes read the clocks, and derive from Node, when they are imported.
SIM_TIME.install()
sim_node.install()

import numpy as np  # noqa: E402
import psutil  # noqa: E402

import likeme_arm.hold_keeper_node  # noqa: E402
import likeme_core.ros.heartbeat  # noqa: E402
from faults_parts import fault_kinds, story  # noqa: E402
from faults_parts.fault_kinds import Fault  # noqa: E402
from faults_parts.results import CellResult, Trouble  # noqa: E402
from faults_parts.sim_cell import Cell  # noqa: E402
from faults_parts.sim_store import StoreFaults  # noqa: E402

#: s between messages in simulated time: fewer than in a cell, for speed.
HEARTBEAT, HOLD_STATE = 0.2, 0.1
#: s for what is under way to arrive before the log is read.
REST = 3.0
MODES = ('interactive', 'interactive', 'goal_based', 'sequential', 'trajectory')

_STORES = StoreFaults()


def play_cell(number: int, stories: int, kinds: tuple[str, ...] = ()) -> CellResult:
    """Play the stories of one cell, which goes on with one log.

    number: its seed. kinds: only faults of these.
    """
    found = CellResult(Counter(), 0, [], [], [], [], [])
    with _cell(number) as (cell, rng):
        for index in range(stories):
            fault = fault_kinds.draw(rng)
            if kinds and fault.kind not in kinds:
                fault = fault._replace(kind=str(rng.choice(kinds)))
            known = sum(cell.monitor.counts.values()), len(cell.ledger.early)
            went = story.play(cell, fault, rng)
            found.faults[fault.kind] += 1
            found.recovery.append(went.seconds)
            _note(found, cell, Trouble(number, index, '', str(fault)), went, known)
            if not went.finished:
                # After a story that hangs the cell is of no use any more.
                break
            found = found._replace(finished=found.finished + 1)
        cell.graph.run(REST)
        lost, problem = cell.check_log()
        about = Trouble(number, stories - 1, '', 'in the end')
        found.lost_entries.extend(about._replace(what=str(key)) for key in lost)
        if problem:
            found.lost_entries.append(about._replace(what=problem))
    return found


def soak(number: int, stories: int) -> tuple[int, list[float]]:
    """Play so many stories in one cell; violations, and memory after each tenth of them, MiB."""
    fault = Fault('operator answers twice', 'after decision', 0, '', '', 0.0, 0.0)
    memory, process = [], psutil.Process()
    with _cell(number) as (cell, rng):
        # It remembers everything.
        cell.graph.observers.remove(cell.ledger.observe)
        cell.stores.on_written = lambda _kind, _data: None
        for index in range(1, stories + 1):
            if not story.play(cell, fault, rng).finished:
                break
            if index % max(1, stories // 10) == 0:
                memory.append(process.memory_info().rss / 2**20)
        return sum(cell.monitor.counts.values()), memory


@contextmanager
def _cell(number: int) -> Iterator[tuple[Cell, np.random.Generator]]:
    """A cell by its seed, and the generator for its stories."""
    _quicken()
    rng = np.random.default_rng(number)
    SIM_TIME.jump = 0
    folder = Path(tempfile.mkdtemp(prefix='likeme_faults_', dir=_memory()))
    mode, threshold = MODES[number % len(MODES)], float(rng.uniform(0.3, 0.95))
    cell = Cell(folder, rng, _STORES, mode=mode, help_threshold=threshold)
    try:
        yield cell, rng
    finally:
        cell.close()
        shutil.rmtree(folder)


def _quicken() -> None:
    _STORES.install()
    for module, name, value in (
        (likeme_core.ros.heartbeat, 'HEARTBEAT_PERIOD', HEARTBEAT),
        (likeme_arm.hold_keeper_node, 'STATE_PERIOD', HOLD_STATE),
    ):
        setattr(module, name, value)


def _note(
    found: CellResult, cell: Cell, about: Trouble, went: story.Story, known: tuple[int, int]
) -> None:
    """Add what went wrong in one story."""
    new = sum(cell.monitor.counts.values()) - known[0]
    for violation in list(cell.monitor.violations)[-new:] if new else []:
        sentence = f'{violation.policy}: {violation.sentence}'
        found.violations.append(about._replace(what=sentence))
    for key in cell.ledger.early[known[1] :]:
        found.violations.append(about._replace(what=f'published before it was logged: {key}'))
    if not went.finished:
        found.unfinished.append(about._replace(what=went.reason))
    asking = cell.open
    if asking is None or asking.kind != story.ASK_HUMAN:
        return
    if asking.id not in cell.monitor.seen.answers:
        found.lost_questions.append(about._replace(what=f'question {asking.id}'))


def _memory() -> str | None:
    """A folder in memory, if there is one."""
    return '/dev/shm' if Path('/dev/shm').is_dir() else None

"""What callers of the simulation driver get, also when the simulation fails."""

from __future__ import annotations

import pathlib
import threading
import time
from collections.abc import Iterator

import pytest

from likeme_arm import job_thread, motion_driver
from likeme_arm.hold_monitor import Block, HoldMonitor
from likeme_arm.motion import ObjectView
from likeme_arm.motion_driver import MotionRequest, StampedResult
from likeme_arm.motion_journal import JournalError, MotionJournal, MotionRecord
from likeme_arm_sim import motion_control
from likeme_arm_sim.cell import Cell
from likeme_arm_sim.simulation_driver import SimulationDriver, SimulationSettings
from likeme_core.outcomes import Actor, MotionOutcome
from likeme_core.paper_world import RIGHT, WORLD

PLACE = 'place_left'
CHICKEN = {'chicken': ObjectView(0.44, -0.2, 0.0, RIGHT)}


class Watched:
    """A driver with its reported errors, whose steps can be made to fail."""

    def __init__(self, cell: Cell) -> None:
        self.errors: list[Exception] = []
        self.failing: Exception | None = None
        self.stepped = threading.Event()
        self.driver = SimulationDriver(
            cell, SimulationSettings(), self._on_step, self.errors.append
        )
        self.driver.real_time_factor = 0.0
        self.driver.start()

    def _on_step(self) -> None:
        self.stepped.set()
        if self.failing is not None and self.driver.busy:
            raise self.failing


@pytest.fixture(scope='module')
def cell() -> Cell:
    return Cell(WORLD, 1)


@pytest.fixture
def watched(cell: Cell) -> Iterator[Watched]:
    cell.resume()
    cell.reset([], [], 0)
    made = Watched(cell)
    yield made
    made.driver.stop()


def act(watched: Watched, actor: Actor = Actor.HUMAN, expires: int = 0) -> StampedResult:
    job = watched.driver.execute(MotionRequest(actor, 'chicken', PLACE, expires))
    assert job is not None
    return job.result(30.0)


def test_a_motion_that_raises_is_answered_failed_and_logged(watched: Watched) -> None:
    watched.failing = RuntimeError('out of memory')
    result = act(watched)
    assert result.outcome is MotionOutcome.FAILED
    assert result.message == 'The motion failed: RuntimeError: out of memory'
    assert watched.errors == [watched.failing]
    assert watched.driver.errors == 1
    watched.failing = None
    watched.stepped.clear()
    assert watched.stepped.wait(5.0)
    assert act(watched).outcome is MotionOutcome.COMPLETED


def test_one_motion_at_a_time(watched: Watched) -> None:
    first = watched.driver.execute(MotionRequest(Actor.HUMAN, 'chicken', PLACE))
    assert first is not None
    assert watched.driver.execute(MotionRequest(Actor.HUMAN, 'pear', PLACE)) is None
    assert watched.driver.reset([], [], 0) is None
    robots_turn = watched.driver.execute(MotionRequest(Actor.ROBOT, 'chicken', PLACE))
    assert robots_turn is not None
    watched.driver.cell.hold()
    assert first.result(30.0).outcome is MotionOutcome.HELD
    assert robots_turn.result(5.0).started == 0


def test_a_late_request_is_not_begun(watched: Watched) -> None:
    late = act(watched, expires=watched.driver.now - 2_000_000_000)
    assert late.outcome is MotionOutcome.EXPIRED
    assert late.started == 0


def test_a_refused_reset_says_why(watched: Watched) -> None:
    job = watched.driver.reset(['pear'], [9], 0)
    assert job is not None
    assert str(job.exception(10.0)) == (
        'Expected a state of chung2015 (left, right, offtable), got 9.'
    )
    assert watched.errors == []


def test_a_reset_that_fails_is_logged(watched: Watched, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        raise RuntimeError('out of memory')

    monkeypatch.setattr(watched.driver.cell, 'reset', fail)
    job = watched.driver.reset([], [], 0)
    assert job is not None
    assert str(job.exception(10.0)) == 'out of memory'
    assert [str(error) for error in watched.errors] == ['out of memory']


def test_a_reset_clears_the_perceived_objects(watched: Watched) -> None:
    now = watched.driver.now
    watched.driver.perceived.update(now + 10, CHICKEN, now)
    job = watched.driver.reset([], [], 0)
    assert job is not None
    job.result(10.0)
    assert act(watched, Actor.ROBOT).outcome is MotionOutcome.OBJECT_NOT_SEEN


def test_stamps_are_of_the_system_clock_while_a_part_is_real(cell: Cell) -> None:
    settings = SimulationSettings(wall_time=True)
    driver = SimulationDriver(cell, settings, lambda: None, lambda _: None)
    before, stamp, after = time.time_ns(), driver.now, time.time_ns()
    assert before <= stamp <= after


def test_a_simulation_that_does_not_end_is_logged(
    cell: Cell, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(job_thread, 'JOIN_TIMEOUT', 0.05)
    stepping, release = threading.Event(), threading.Event()

    def on_step() -> None:
        stepping.set()
        release.wait(30.0)

    errors: list[Exception] = []
    driver = SimulationDriver(cell, SimulationSettings(), on_step, errors.append)
    driver.start()
    assert stepping.wait(30.0)
    driver.stop()
    release.set()
    assert [str(error) for error in errors] == [
        'Expected the driver thread to end within 0.05 s, it still runs.'
    ]
    driver.stop()
    cell.resume()


def test_a_request_is_carried_out_once_and_its_end_is_known(
    cell: Cell, tmp_path: pathlib.Path
) -> None:
    cell.resume()
    cell.reset([], [], 0)
    journal, told = MotionJournal(tmp_path / 'motions.sqlite'), list[MotionRecord]()
    driver = SimulationDriver(
        cell, SimulationSettings(), lambda: None, lambda _: None, journal, told.append
    )
    driver.real_time_factor = 0.0
    driver.start()
    request = MotionRequest(Actor.HUMAN, 'chicken', 'place_left', id='a')
    first, again = (driver.execute(request).result(30.0) for _ in range(2))
    driver.stop()
    assert first.outcome is MotionOutcome.COMPLETED
    assert again == StampedResult(
        MotionOutcome.REPEATED,
        'Request a was carried out before, it ended as COMPLETED: nothing was started.',
    )
    assert [record.outcome for record in told] == [None, MotionOutcome.COMPLETED]
    assert told[1] == journal.find('a')
    assert told[1].action == 'PLACE_LEFT'
    assert told[1].world == WORLD.label


def test_nothing_moves_that_cannot_be_kept(cell: Cell, tmp_path: pathlib.Path) -> None:
    cell.resume()
    cell.reset([], [], 0)
    journal = MotionJournal(tmp_path / 'motions.sqlite')
    driver = SimulationDriver(cell, SimulationSettings(), lambda: None, lambda _: None, journal)
    driver.start()
    journal.close()
    result = driver.execute(MotionRequest(Actor.HUMAN, 'chicken', PLACE, id='a')).result(30.0)
    driver.stop()
    assert result.outcome is MotionOutcome.FAILED
    assert result.message.startswith('Nothing moved: ')
    assert result.started == 0


def test_an_end_that_could_not_be_written_is_written_later(
    cell: Cell, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    cell.resume()
    cell.reset([], [], 0)
    journal, errors, stepped = MotionJournal(tmp_path / 'm.sqlite'), list[Exception](), [0]
    write, full = journal.end, [True]

    def end(record: MotionRecord) -> None:
        if full[0]:
            raise JournalError('disk full')
        write(record)

    monkeypatch.setattr(journal, 'end', end)
    monkeypatch.setattr(motion_driver, 'WRITE_PERIOD', 0.0)
    written = threading.Event()

    def on_step() -> None:
        stepped[0] += 1
        record = journal.find('a')
        if not full[0] and record is not None and record.outcome is not None:
            written.set()

    driver = SimulationDriver(cell, SimulationSettings(), on_step, errors.append, journal)
    driver.real_time_factor = 0.0
    driver.start()
    result = driver.execute(MotionRequest(Actor.HUMAN, 'chicken', PLACE, id='a')).result(60.0)
    assert result.outcome is MotionOutcome.COMPLETED
    assert [str(error) for error in errors][:1] == ['disk full']
    full[0] = False
    assert written.wait(30.0)
    driver.stop()


def test_a_motion_pauses_while_the_keeper_is_late_and_ends_when_it_is_gone(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(motion_control, 'KEEPER_PATIENCE', 0.2)
    blocks: list[Block] = []
    cell = Cell(WORLD, 1, block=lambda: blocks[-1] if blocks else None)
    began, paused = cell.time, list[float]()

    def on_tick() -> None:
        if cell.time - began > 1.0 and not paused:
            blocks.append(Block.UNHEARD)
        if blocks:
            paused.append(cell.time)
        if len(paused) == 10:
            blocks.clear()
        if cell.time - began > 2.0 and not blocks:
            blocks.append(Block.UNHEARD)

    result = cell.run_action(Actor.HUMAN, 'chicken', PLACE, lambda _: None, on_tick)
    assert len(paused) > 10
    assert result.finished > began + 2.0
    assert result.outcome is MotionOutcome.HELD
    assert result.message == 'The motion was stopped: the hold keeper was not heard any more.'


def test_a_hold_that_was_over_before_it_was_heard_ends_the_motion() -> None:
    hold = HoldMonitor()
    hold.hear(False, 1)
    cell = Cell(WORLD, 1, block=lambda: hold.block, change=lambda: hold.change)
    began = cell.time

    def on_tick() -> None:
        # Changes 2 and 3, of which the first was lost with its keeper.
        hold.hear(False, 3 if cell.time - began > 1.0 else 1)

    result = cell.run_action(Actor.HUMAN, 'chicken', PLACE, lambda _: None, on_tick)
    assert result.outcome is MotionOutcome.HELD
    assert began + 1.0 < result.finished < began + 1.1
    # The next one is another matter.
    again = cell.run_action(Actor.HUMAN, 'chicken', PLACE, lambda _: None, on_tick)
    assert again.outcome is MotionOutcome.COMPLETED


def test_a_cancelled_motion_stops_where_it_is_and_nothing_moves_until_the_next(
    watched: Watched, cell: Cell
) -> None:
    driver, cancel, phases = watched.driver, threading.Event(), set[str]()
    driver.perceived.update(driver.now, CHICKEN, driver.now)
    lowered = threading.Event()

    def cancelled() -> bool:
        """Asked at every control step: cancels when the hand has begun to go down."""
        phases.add(driver.phase('one'))
        if 'lower' in phases:
            lowered.set()
            cancel.set()
        return cancel.is_set()

    request = MotionRequest(Actor.ROBOT, 'chicken', PLACE, 0, 'one', cancelled)
    assert driver.phase('one') == 'waiting'
    job = driver.execute(request)
    assert job is not None
    result = job.result(30.0)
    assert lowered.is_set()
    assert phases >= {'open gripper', 'reach', 'lower'}
    assert result.outcome is MotionOutcome.HELD
    assert result.message == 'The motion was cancelled before it was complete.'
    assert 0 < result.started < result.finished
    # The brakes come to rest in a few steps.
    began = cell.time
    while cell.time < began + 0.2:
        assert watched.stepped.wait(5.0)
        watched.stepped.clear()
    stopped, began = cell.arm.joints, cell.time
    assert not cell.arm.at_home
    while cell.time < began + 1.0:
        assert watched.stepped.wait(5.0)
        watched.stepped.clear()
    assert abs(cell.arm.joints - stopped).max() < 1e-3
    assert driver.cell.block is None
    assert act(watched).outcome is MotionOutcome.COMPLETED


def test_a_request_that_was_cancelled_while_it_waited_moves_nothing(watched: Watched) -> None:
    request = MotionRequest(Actor.HUMAN, 'chicken', PLACE, 0, 'two', lambda: True)
    job = watched.driver.execute(request)
    assert job is not None
    result = job.result(30.0)
    assert (result.outcome, result.started) == (MotionOutcome.HELD, 0)

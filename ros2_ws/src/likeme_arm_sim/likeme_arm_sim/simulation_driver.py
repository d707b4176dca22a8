"""Steps a cell in a thread: motions one at a time, paced by the wall clock.

A running motion advances simulated time; without one the idle function does. Robot and person wait
for each other's motions, because each must leave the table before the other acts.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from typing import NamedTuple

from likeme_arm.hold_monitor import Block
from likeme_arm.motion import ObjectView
from likeme_arm.motion_journal import JournalError, MotionJournal, MotionRecord
from likeme_arm.perceived_objects import PerceivedObjects
from likeme_arm_sim.cell import Cell
from likeme_arm_sim.motion_control import KEEPER_PATIENCE
from likeme_arm_sim.pacer import Pacer
from likeme_arm_sim.physics_world import STEP_RATE
from likeme_arm_sim.simulation_thread import SimulationThread
from likeme_core.outcomes import Actor, MotionOutcome

#: s between two attempts to write how a motion ended.
WRITE_PERIOD = 1.0


@dataclass(frozen=True)
class SimulationSettings:
    """Times and rates, in simulated s.

    Attributes:
        camera_rate: frames per s.
        motion_budget: greatest duration of a motion, s.
        table_state_timeout: greatest age of a table state that is acted on, s.
        wall_time: stamps are of the system clock, because real parts of the cell use it.
    """

    camera_rate: float = 30.0
    motion_budget: float = 60.0
    table_state_timeout: float = 2.0
    wall_time: bool = False


class StampedResult(NamedTuple):
    """How a motion ended; its start and end, ns since the epoch, 0 if nothing moved."""

    outcome: MotionOutcome
    message: str
    started: int = 0
    finished: int = 0


class MotionRequest(NamedTuple):
    """A request to move.

    Attributes:
        actor: who moves.
        object, action: their names.
        expires: ns since the epoch after which the motion is not started; 0: never.
        id: unique across runs, see MotionJournal; empty: the request may be repeated.
        cancelled: whether this request is to stop; asked at every control step.
    """

    actor: Actor
    object: str
    action: str
    expires: int = 0
    id: str = ''
    cancelled: Callable[[], bool] = lambda: False


class SimulationDriver:
    """Runs a cell in its own thread; every method may be called from any thread.

    Attributes:
        real_time_factor: simulated s per s; 0: as fast as possible.
        errors: number of motions and idle steps that failed.
        perceived: the objects as perception reported them.
    """

    def __init__(
        self,
        cell: Cell,
        settings: SimulationSettings,
        on_step: Callable[[], None],
        on_error: Callable[[Exception], None],
        journal: MotionJournal | None = None,
        on_motion: Callable[[MotionRecord], None] = lambda _: None,
    ) -> None:
        """Set up the driver; `start` starts it.

        Args:
            cell: what is stepped.
            settings: times and rates.
            on_step: called after every step.
            on_error: called with the error of a motion or an idle step.
            journal: of requests with an id; None: none is kept.
            on_motion: called when such a motion begins and when it has ended. All are called in
                the simulation's thread.
        """
        self.cell, self._settings, self._on_step = cell, settings, on_step
        self._report_error = on_error
        self._journal, self._on_motion = journal, on_motion
        self._unwritten: list[MotionRecord] = []
        self._next_write = 0.0
        self.real_time_factor, self.errors = 1.0, 0
        self.perceived = PerceivedObjects(settings.table_state_timeout)
        self._thread = SimulationThread(self._idle, self._on_error)
        self._pacer = Pacer()
        self._set_epoch()
        self._steps_per_frame = max(1, round(STEP_RATE / settings.camera_rate))
        self._was_blocked = False
        self._moving: MotionRequest | None = None

    @property
    def busy(self) -> bool:
        """Whether a motion or a reset is queued or running."""
        return self._thread.busy

    @property
    def now(self) -> int:
        """Time of the present step, ns since the epoch: simulated, or of the system clock."""
        if self._settings.wall_time:
            return time.time_ns()
        return self._epoch + round(self.cell.time * 1e9)

    @property
    def frame_due(self) -> bool:
        """Whether the camera takes a frame after this physics step."""
        return self.cell.physics_world.steps % self._steps_per_frame == 0

    def start(self) -> None:
        """Start the simulation."""
        # Building the node took seconds: simulated time begins at that of the system clock.
        self._set_epoch()
        self._pacer.restart(self.cell.time)
        self._thread.start()

    def stop(self) -> None:
        """Hold a running motion and wait for the thread to end; nothing is stepped after it."""
        self.cell.hold()
        try:
            self._thread.stop()
        except TimeoutError as error:
            self._on_error(error)

    def execute(self, request: MotionRequest) -> Future[StampedResult] | None:
        """Queue an action; None while this actor's last one has not ended."""
        return self._thread.submit(request.actor.name, lambda: self._run(request))

    def phase(self, request_id: str) -> str:
        """What the actor of a request does now; 'waiting' before its motion."""
        moving = self._moving
        if moving is None or moving.id != request_id:
            return 'waiting'
        return self.cell.arm.phase if moving.actor is Actor.ROBOT else 'move'

    def reset(
        self, objects: Sequence[str], states: Sequence[int | str], seed: int
    ) -> Future[None] | None:
        """Set the table up (see Cell.reset); None while a motion or a reset is in progress."""
        if self._thread.busy:
            return None
        return self._thread.submit('reset', lambda: self._reset(objects, states, seed))

    def _set_epoch(self) -> None:
        self._epoch = time.time_ns() - round(self.cell.time * 1e9)

    def _run(self, request: MotionRequest) -> StampedResult:
        if self._journal is None or not request.id:
            return self._move(request)
        # Names as the world file has them, where it has them.
        action = self._action_name(request.action)
        record = MotionRecord(
            request.id, request.actor, self.cell.world.label, request.object, action
        )
        try:
            before = self._journal.begin(record)
        except JournalError as error:
            return StampedResult(MotionOutcome.FAILED, f'Nothing moved: {error}')
        if before is not None:
            return StampedResult(MotionOutcome.REPEATED, before.refusal)
        self._on_motion(record)
        result = self._move(request)
        ended = record._replace(
            outcome=result.outcome, message=result.message, started=result.started,
            finished=result.finished,
        )  # fmt: skip
        self._unwritten.append(ended)
        self._write_ends()
        self._on_motion(ended)
        return result

    def _write_ends(self) -> None:
        """Keep how motions ended; again later, if that cannot be written now."""
        assert self._journal is not None, 'Only motions with a journal are kept.'
        while self._unwritten:
            try:
                self._journal.end(self._unwritten[0])
            except JournalError as error:
                self._on_error(error)
                self._next_write = time.monotonic() + WRITE_PERIOD
                return
            self._unwritten.pop(0)

    def _action_name(self, action: str) -> str:
        try:
            return self.cell.world.action(action).name
        except ValueError:
            return action

    def _move(self, request: MotionRequest) -> StampedResult:
        self._wait_for_keeper()
        if request.cancelled():
            return StampedResult(MotionOutcome.HELD, 'The request was cancelled: nothing moved.')
        started = self.now
        if request.expires and started > request.expires:
            late = (started - request.expires) * 1e-9
            return StampedResult(MotionOutcome.EXPIRED, f'The request expired {late:.1f} s ago.')
        self._moving = request
        try:
            result = self.cell.run_action(
                request.actor, request.object, request.action, self._view, self._tick,
                self._settings.motion_budget, request.cancelled,
            )  # fmt: skip
        except Exception as error:
            self._on_error(error)
            message = f'The motion failed: {type(error).__name__}: {error}'
            return StampedResult(MotionOutcome.FAILED, message, started, self.now)
        finally:
            self._moving = None
        moved = (started, self.now) if result.started is not None else ()
        return StampedResult(result.outcome, result.message, *moved)

    def _wait_for_keeper(self) -> None:
        """A keeper that is late for a moment delays a motion; it does not refuse it."""
        deadline = time.monotonic() + KEEPER_PATIENCE
        while self.cell.block is Block.UNHEARD and time.monotonic() < deadline:
            self._idle()

    def _reset(self, objects: Sequence[str], states: Sequence[int | str], seed: int) -> None:
        try:
            self.cell.reset(objects, states, seed)
        except Exception as error:
            # A ValueError refuses the request; the caller gets its message.
            if not isinstance(error, ValueError):
                self._on_error(error)
            raise
        self.perceived.clear(self.now)
        self._pacer.restart(self.cell.time)

    def _view(self, name: str) -> ObjectView | None:
        return self.perceived.view(name, self.now)

    def _idle(self) -> None:
        """Without a motion: step up to the next frame; after a hold, clear the table first."""
        blocked = self.cell.block is not None
        if self._was_blocked and not blocked:
            self.cell.clear_table(self._tick)
        self._was_blocked = blocked
        if self._unwritten and time.monotonic() > self._next_write:
            self._write_ends()
        for _ in range(self._steps_per_frame):
            self.cell.step()
            self._on_step()
        # A factor of 0 is for motions: idling at full speed would load a core for nothing.
        self._pacer.wait(self.cell.time, self.real_time_factor or 1.0)

    def _tick(self) -> None:
        """After every physics step of a motion."""
        self._on_step()
        self._pacer.wait(self.cell.time, self.real_time_factor)

    def _on_error(self, error: Exception) -> None:
        self.errors += 1
        self._report_error(error)

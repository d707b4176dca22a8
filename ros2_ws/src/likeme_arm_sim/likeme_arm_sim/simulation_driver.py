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

from likeme_arm.motion import ObjectView
from likeme_arm.perceived_objects import PerceivedObjects
from likeme_arm_sim.cell import Cell
from likeme_arm_sim.pacer import Pacer
from likeme_arm_sim.physics_world import STEP_RATE
from likeme_arm_sim.simulation_thread import SimulationThread
from likeme_core.outcomes import Actor, MotionOutcome


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
    ) -> None:
        """on_step, on_error: called in the simulation's thread, on_step after every step."""
        self.cell, self._settings, self._on_step = cell, settings, on_step
        self._report_error = on_error
        self.real_time_factor, self.errors = 1.0, 0
        self.perceived = PerceivedObjects(settings.table_state_timeout)
        self._thread = SimulationThread(self._idle, self._on_error)
        self._pacer = Pacer()
        self._epoch = time.time_ns() - round(cell.time * 1e9)
        self._steps_per_frame = max(1, round(STEP_RATE / settings.camera_rate))
        self._clear_table_due = False

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
        self._pacer.restart(self.cell.time)
        self._thread.start()

    def stop(self) -> None:
        """Hold a running motion and wait for the thread to end; nothing is stepped after it."""
        self.cell.hold()
        try:
            self._thread.stop()
        except TimeoutError as error:
            self._on_error(error)

    def execute(
        self, actor: Actor, name: str, action: int | str, expires: int = 0
    ) -> Future[StampedResult] | None:
        """Queue an action; None while this actor's last one has not ended.

        expires: ns since the epoch after which the motion is not started; 0: never.
        """
        return self._thread.submit(actor.name, lambda: self._run(actor, name, action, expires))

    def reset(
        self, objects: Sequence[str], states: Sequence[int | str], seed: int
    ) -> Future[None] | None:
        """Set the table up (see Cell.reset); None while a motion or a reset is in progress."""
        if self._thread.busy:
            return None
        return self._thread.submit('reset', lambda: self._reset(objects, states, seed))

    def hold(self) -> str:
        """Stop all motion before the next control step; returns a message."""
        message = 'The cell was held already.' if self.cell.held else 'The cell is held.'
        self.cell.hold()
        return message

    def resume(self) -> str:
        """Allow motion, and move arm and hand off the table first; returns a message."""
        if not self.cell.held:
            return 'Nothing was held.'
        self.cell.resume()
        self._clear_table_due = True
        return 'Motion is allowed again.'

    def _run(self, actor: Actor, name: str, action: int | str, expires: int) -> StampedResult:
        started = self.now
        if expires and started > expires:
            late = (started - expires) * 1e-9
            return StampedResult(MotionOutcome.EXPIRED, f'The request expired {late:.1f} s ago.')
        budget = self._settings.motion_budget
        try:
            result = self.cell.run_action(actor, name, action, self._view, self._tick, budget)
        except Exception as error:
            self._on_error(error)
            message = f'The motion failed: {type(error).__name__}: {error}'
            return StampedResult(MotionOutcome.FAILED, message, started, self.now)
        moved = (started, self.now) if result.started is not None else ()
        return StampedResult(result.outcome, result.message, *moved)

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
        if self._clear_table_due and not self.cell.held:
            self._clear_table_due = False
            self.cell.clear_table(self._tick)
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

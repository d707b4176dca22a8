"""The cell kept going: one motion at a time, time in step with the wall clock.

A running motion drives simulated time; when nothing moves, idling does. Robot and person wait for
each other: a hand that is leaving must not make the arm refuse its turn.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from dataclasses import dataclass

from likeme_arm.motion import ObjectView
from likeme_arm.perceived_objects import PerceivedObjects
from likeme_arm_sim.cell import Cell, MotionResult
from likeme_arm_sim.pacer import Pacer
from likeme_arm_sim.physics_world import STEP_RATE
from likeme_arm_sim.simulation_thread import SimulationThread
from likeme_core.outcomes import Actor, MotionOutcome


@dataclass(frozen=True)
class SimulationSettings:
    """Times and rates, in simulated s.

    Attributes:
        camera_rate: frames per s.
        motion_budget: that a motion may take, s.
        table_state_timeout: for which a table state may be acted on, s.
    """

    camera_rate: float = 30.0
    motion_budget: float = 60.0
    table_state_timeout: float = 2.0


class SimulationDriver:
    """Drives a cell in a thread of its own; every method may be called from any other.

    Attributes:
        real_time_factor: simulated s per s; 0: as fast as it goes.
        errors: how often a motion or idling failed.
    """

    def __init__(
        self,
        cell: Cell,
        settings: SimulationSettings,
        on_step: Callable[[], None],
        on_error: Callable[[Exception], None],
    ) -> None:
        """on_step, on_error: called in the driver's thread, after every physics step."""
        self.cell, self._settings, self._on_step = cell, settings, on_step
        self._tell_error = on_error
        self.real_time_factor, self.errors = 1.0, 0
        self.perceived = PerceivedObjects(settings.table_state_timeout)
        self._thread = SimulationThread(self._idle, self._on_error)
        self._pacer = Pacer()
        self._epoch = time.time_ns() - round(cell.time * 1e9)
        self._steps_per_frame = max(1, round(STEP_RATE / settings.camera_rate))
        self._clear_table_due = False

    @property
    def busy(self) -> bool:
        """Whether a motion or a reset is in progress or waits for its turn."""
        return self._thread.busy

    @property
    def now(self) -> int:
        """Simulated time, ns since the epoch."""
        return self.stamp(self.cell.time)

    @property
    def frame_due(self) -> bool:
        """Whether the camera takes a picture after this physics step."""
        return self.cell.world.steps % self._steps_per_frame == 0

    def stamp(self, cell_time: float) -> int:
        """A time on the cell's clock (s) as ns since the epoch."""
        return self._epoch + round(cell_time * 1e9)

    def start(self) -> None:
        """Let time pass."""
        self._pacer.restart(self.cell.time)
        self._thread.start()

    def stop(self) -> None:
        """End a running motion at once, for good, and wait until no step is taken any more."""
        self.cell.hold()
        self._thread.stop()

    def act(
        self, actor: Actor, name: str, action: int, expires: int = 0
    ) -> Future[MotionResult] | None:
        """Do one of the six actions next; None while this actor's last one has not ended.

        expires: ns since the epoch after which it is not begun any more; 0: never.
        """
        return self._thread.submit(actor.name, lambda: self._run(actor, name, action, expires))

    def reset(
        self, objects: Sequence[str], states: Sequence[int], seed: int
    ) -> Future[None] | None:
        """Set the table up (see Cell.reset); None while something else is in progress."""
        if self._thread.busy:
            return None
        return self._thread.submit('reset', lambda: self._set_up(objects, states, seed))

    def hold(self) -> str:
        """Stop all motion before the next control step; a sentence about it."""
        said = 'The cell was held already.' if self.cell.held else 'The cell is held.'
        self.cell.hold()
        return said

    def resume(self) -> str:
        """Allow motion again, and have the table cleared of arm and hand; a sentence about it."""
        if not self.cell.held:
            return 'Nothing was held.'
        self.cell.resume()
        self._clear_table_due = True
        return 'Motion is allowed again.'

    def _run(self, actor: Actor, name: str, action: int, expires: int) -> MotionResult:
        began = self.cell.time
        if expires and self.now > expires:
            late = (self.now - expires) * 1e-9
            return MotionResult(MotionOutcome.EXPIRED, f'The request expired {late:.1f} s ago.')
        budget = self._settings.motion_budget
        try:
            return self.cell.run_action(actor, name, action, self._look, self._tick, budget)
        except Exception as error:
            self._on_error(error)
            said = f'The motion failed: {type(error).__name__}: {error}'
            return MotionResult(MotionOutcome.FAILED, said, began, self.cell.time)

    def _set_up(self, objects: Sequence[str], states: Sequence[int], seed: int) -> None:
        try:
            self.cell.reset(objects, states, seed)
        except Exception as error:
            # A ValueError is a refusal, which the caller is told.
            if not isinstance(error, ValueError):
                self._on_error(error)
            raise
        self.perceived.forget(self.now)
        self._pacer.restart(self.cell.time)

    def _look(self, name: str) -> ObjectView | None:
        return self.perceived.look(name, self.now)

    def _idle(self) -> None:
        """Between motions: let time pass up to the next frame, or clear the table after a hold."""
        if self._clear_table_due and not self.cell.held:
            self._clear_table_due = False
            self.cell.clear_table(self._tick)
        for _ in range(self._steps_per_frame):
            self.cell.step()
            self._on_step()
        # Idling knows no "as fast as it goes".
        self._pacer.wait(self.cell.time, self.real_time_factor or 1.0)

    def _tick(self) -> None:
        """After every physics step of a motion."""
        self._on_step()
        self._pacer.wait(self.cell.time, self.real_time_factor)

    def _on_error(self, error: Exception) -> None:
        self.errors += 1
        self._tell_error(error)

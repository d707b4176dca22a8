"""Steps a cell in a thread: motions one at a time, paced by the wall clock.

A running motion advances simulated time; without one the idle function does. Robot and person wait
for each other's motions, because each must leave the table before the other acts.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from dataclasses import dataclass

from likeme_arm.hold_monitor import Block
from likeme_arm.motion import PrimitiveResult
from likeme_arm.motion_driver import MotionDriver, MotionRequest
from likeme_arm.motion_journal import MotionJournal, MotionRecord
from likeme_arm_sim.cell import Cell
from likeme_arm_sim.pacer import Pacer
from likeme_arm_sim.physics_world import STEP_RATE
from likeme_core.outcomes import Actor


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


class SimulationDriver(MotionDriver):
    """Runs a cell in its own thread; every method may be called from any thread.

    Attributes:
        cell: what is stepped.
        real_time_factor: simulated s per s; 0: as fast as possible.
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
        super().__init__(cell.world, settings.table_state_timeout, on_error, journal, on_motion)
        self.real_time_factor = 1.0
        self._pacer = Pacer()
        self._set_epoch()
        self._steps_per_frame = max(1, round(STEP_RATE / settings.camera_rate))
        self._was_blocked, self._last_change = False, cell.change

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

    @property
    def block(self) -> Block | None:
        """Why nothing may move; None: motion is allowed."""
        return self.cell.block

    def hold(self) -> None:
        """Stop a running motion at the next control step."""
        self.cell.hold()

    def start(self) -> None:
        """Start the simulation."""
        # Building the node took seconds: simulated time begins at that of the system clock.
        self._set_epoch()
        self._pacer.restart(self.cell.time)
        super().start()

    def reset(
        self, objects: Sequence[str], states: Sequence[int | str], seed: int
    ) -> Future[None] | None:
        """Set the table up (see Cell.reset); None while a motion or a reset is in progress."""
        if self._thread.busy:
            return None
        return self._thread.submit('reset', lambda: self._reset(objects, states, seed))

    def _set_epoch(self) -> None:
        self._epoch = time.time_ns() - round(self.cell.time * 1e9)

    def _phase_of(self, actor: Actor) -> str:
        return self.cell.arm.phase if actor is Actor.ROBOT else 'move'

    def _perform(self, request: MotionRequest) -> tuple[PrimitiveResult, bool]:
        result = self.cell.run_action(
            request.actor, request.object, request.action, self._view, self._tick,
            self._settings.motion_budget, request.cancelled, self.perceived.others,
        )  # fmt: skip
        ending = PrimitiveResult(result.outcome, result.message)
        return ending, result.started is not None

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

    def _idle(self) -> None:
        """Without a motion: step up to the next frame; after a hold, clear the table first."""
        blocked, change = self.block is not None, self.cell.change
        if not blocked and (self._was_blocked or change != self._last_change):
            self.cell.clear_table(self._tick)
        self._was_blocked, self._last_change = blocked, change
        self._write_late_ends()
        for _ in range(self._steps_per_frame):
            self.cell.step()
            self._on_step()
        # A factor of 0 is for motions: idling at full speed would load a core for nothing.
        self._pacer.wait(self.cell.time, self.real_time_factor or 1.0)

    def _tick(self) -> None:
        """After every physics step of a motion."""
        self._on_step()
        self._pacer.wait(self.cell.time, self.real_time_factor)

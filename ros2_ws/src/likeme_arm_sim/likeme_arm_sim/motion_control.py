"""Steps the physics during a motion, and stops the motion on a hold or at its deadline."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

import numpy as np

from likeme_arm.hold_monitor import Block
from likeme_arm.motion import PrimitiveResult
from likeme_arm.motion_stop import KEEPER_PATIENCE, MotionStoppedError, stopped
from likeme_arm_sim.physics_world import TIME_STEP, PhysicsWorld

OnTick = Callable[[], None]


def _never() -> bool:
    return False


class MotionController:
    """Runs one motion at a time. Only `hold`, `resume` and `block` are thread-safe."""

    def __init__(
        self,
        physics_world: PhysicsWorld,
        block: Callable[[], Block | None] = lambda: None,
        change: Callable[[], int] = lambda: 0,
    ) -> None:
        """Set it up.

        Args:
            physics_world: what moves.
            block: why nothing may move, asked at every control step; None: motion is allowed.
            change: number of the last hold or resume: a hold that was over before it was heard
                ends a motion, too.
        """
        self._physics_world, self._block, self._change = physics_world, block, change
        self._begun_at = 0
        self._held = threading.Event()
        self._stopped_by: Block | None = None
        self._halt: Callable[[], None] = lambda: None
        self._cancelled: Callable[[], bool] = _never
        self._on_tick: OnTick | None = None
        self._deadline = np.inf

    @property
    def block(self) -> Block | None:
        """Why nothing may move; None: motion is allowed."""
        return Block.HELD if self._held.is_set() else self._block()

    @property
    def change(self) -> int:
        """Number of the last hold or resume that was heard."""
        return self._change()

    def hold(self) -> None:
        """Stop all motion before the next control step; may be called from any thread."""
        self._held.set()

    def resume(self) -> None:
        """Allow motion again; may be called from any thread."""
        self._held.clear()

    def tick(self) -> None:
        """Advance by one control step; arm and hand call it in every motion.

        Raises:
            MotionStoppedError: motion is blocked or cancelled, or its time is used up.
        """
        block = self.block
        if block is Block.UNHEARD:
            block = self._wait_for_keeper()
        if block is None and self._change() != self._begun_at:
            block = Block.HELD
        late = self._physics_world.time >= self._deadline
        if block is not None or late or self._cancelled():
            self._stopped_by = block
            raise MotionStoppedError
        self._step()

    def run(
        self,
        motion: Callable[[], PrimitiveResult],
        halt: Callable[[], None],
        on_tick: OnTick | None = None,
        budget: float = np.inf,
        cancelled: Callable[[], bool] = _never,
    ) -> PrimitiveResult:
        """Run a motion; calls `halt` if it does not end normally.

        Args:
            motion: calls `tick` at each of its control steps.
            halt: stops arm and hand.
            on_tick: called after every physics step.
            budget: simulated s after which the motion is stopped.
            cancelled: whether this motion is to stop; asked at every control step.
        """
        self._on_tick, self._halt, self._cancelled = on_tick, halt, cancelled
        self._deadline = self._physics_world.time + budget
        self._begun_at = self._change()
        try:
            return motion()
        except MotionStoppedError:
            halt()
            return stopped(self._stopped_by, self._cancelled())
        except BaseException:
            # Without it the arm would go on to its last target.
            halt()
            raise
        finally:
            self._on_tick, self._deadline, self._stopped_by = None, np.inf, None
            self._cancelled = _never

    def _step(self) -> None:
        self._physics_world.step()
        if self._on_tick is not None:
            self._on_tick()

    def _wait_for_keeper(self) -> Block | None:
        """Stand still while the keeper is not heard; why the motion must end, None to go on.

        A keeper that is late for a moment, on a loaded machine, costs a pause and not the motion.
        """
        self._halt()
        deadline = time.monotonic() + KEEPER_PATIENCE
        while (block := self.block) is Block.UNHEARD and time.monotonic() < deadline:
            self._step()
            time.sleep(TIME_STEP)
        return block

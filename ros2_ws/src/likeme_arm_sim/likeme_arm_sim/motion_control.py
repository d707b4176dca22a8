"""Steps the physics during a motion, and stops the motion on hold or at its deadline."""

from __future__ import annotations

import threading
from collections.abc import Callable

import numpy as np

from likeme_arm.motion import PrimitiveResult
from likeme_arm_sim.physics_world import PhysicsWorld
from likeme_core.outcomes import MotionOutcome

OnTick = Callable[[], None]


class MotionStoppedError(Exception):
    """The motion was stopped before this control step."""


class MotionController:
    """Runs one motion at a time. Only `hold` and `resume` are thread-safe."""

    def __init__(self, physics_world: PhysicsWorld) -> None:
        self._physics_world = physics_world
        self._held = threading.Event()
        self._on_tick: OnTick | None = None
        self._deadline = np.inf

    @property
    def held(self) -> bool:
        """Whether all motion is held."""
        return self._held.is_set()

    def hold(self) -> None:
        """Stop all motion before the next control step; may be called from any thread."""
        self._held.set()

    def resume(self) -> None:
        """Allow motion again; may be called from any thread."""
        self._held.clear()

    def tick(self) -> None:
        """Advance by one control step; arm and hand call it in every motion.

        Raises:
            MotionStoppedError: motion is held, or its time is used up.
        """
        if self.held or self._physics_world.time >= self._deadline:
            raise MotionStoppedError
        self._physics_world.step()
        if self._on_tick is not None:
            self._on_tick()

    def run(
        self,
        motion: Callable[[], PrimitiveResult],
        halt: Callable[[], None],
        on_tick: OnTick | None = None,
        budget: float = np.inf,
    ) -> PrimitiveResult:
        """Run a motion; calls `halt` if it does not end normally.

        Args:
            motion: calls `tick` at each of its control steps.
            halt: stops arm and hand.
            on_tick: called after every physics step.
            budget: simulated s after which the motion is stopped.
        """
        self._on_tick, self._deadline = on_tick, self._physics_world.time + budget
        try:
            return motion()
        except MotionStoppedError:
            halt()
            outcome = MotionOutcome.HELD if self.held else MotionOutcome.FAILED
            return PrimitiveResult(outcome, self._stopped_because())
        except BaseException:
            # Without it the arm would go on to its last target.
            halt()
            raise
        finally:
            self._on_tick, self._deadline = None, np.inf

    def _stopped_because(self) -> str:
        if self.held:
            return 'The motion was held before it was complete.'
        return 'The motion was stopped: its time budget was used up before it was complete.'

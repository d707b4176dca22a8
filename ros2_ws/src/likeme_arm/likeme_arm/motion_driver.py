"""Carries out requests to move one at a time in a thread: ids, expiry, journal and hold.

What every driver has in common, that of the simulated cell and that of a real arm.
"""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from concurrent.futures import Future
from typing import NamedTuple

from likeme_arm.hold_monitor import Block
from likeme_arm.job_thread import JobThread
from likeme_arm.motion import ObjectView, PrimitiveResult
from likeme_arm.motion_journal import JournalError, MotionJournal, MotionRecord
from likeme_arm.motion_stop import KEEPER_PATIENCE
from likeme_arm.perceived_objects import PerceivedObjects
from likeme_core.outcomes import Actor, MotionOutcome
from likeme_core.world import World

#: s between two attempts to write how a motion ended.
WRITE_PERIOD = 1.0


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


class MotionDriver(ABC):
    """Runs motions in its own thread; every method may be called from any thread.

    Attributes:
        world: its objects and actions.
        errors: number of motions and idle steps that failed.
        perceived: the objects as perception reported them.
    """

    def __init__(
        self,
        world: World,
        table_state_timeout: float,
        on_error: Callable[[Exception], None],
        journal: MotionJournal | None = None,
        on_motion: Callable[[MotionRecord], None] = lambda _: None,
    ) -> None:
        """Set up the driver; `start` starts it.

        Args:
            world: what the names of requests mean.
            table_state_timeout: greatest age of a table state that is acted on, s.
            on_error: called with the error of a motion or an idle step.
            journal: of requests with an id; None: none is kept.
            on_motion: called when such a motion begins and when it has ended. Both are called in
                the driver's thread.
        """
        self.world, self._report_error = world, on_error
        self._journal, self._on_motion = journal, on_motion
        self._waiting: dict[str, MotionRecord] = {}
        self._unwritten: list[MotionRecord] = []
        self._next_write = 0.0
        self.errors = 0
        self.perceived = PerceivedObjects(table_state_timeout)
        self._thread = JobThread(self._idle, self._on_error)
        self._moving: MotionRequest | None = None

    @property
    @abstractmethod
    def now(self) -> int:
        """The driver's time, ns since the epoch."""

    @property
    @abstractmethod
    def block(self) -> Block | None:
        """Why nothing may move; None: motion is allowed."""

    @abstractmethod
    def hold(self) -> None:
        """Stop a running motion at the next control step, for good."""

    @abstractmethod
    def _phase_of(self, actor: Actor) -> str:
        """What a moving actor does now, in a word or two."""

    @abstractmethod
    def _perform(self, request: MotionRequest) -> tuple[PrimitiveResult, bool]:
        """Carry out a request; how it ended, and whether anything moved."""

    @abstractmethod
    def _idle(self) -> None:
        """Called again and again between motions; takes up to a frame's time."""

    @property
    def busy(self) -> bool:
        """Whether a motion or another job is queued or running."""
        return self._thread.busy

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def stop(self) -> None:
        """Hold a running motion and wait for the thread to end; nothing moves after it."""
        self.hold()
        try:
            self._thread.stop()
        except TimeoutError as error:
            self._on_error(error)

    def execute(self, request: MotionRequest) -> Future[StampedResult] | None:
        """Queue an action; None while this actor's last one has not ended."""
        record = self._record_of(request)
        job = self._thread.submit(request.actor.name, lambda: self._run(request, record))
        if job is not None:
            self._waiting[record.id] = record
            job.add_done_callback(lambda _: self._waiting.pop(record.id, None))
        return job

    def waiting(self, request_id: str) -> MotionRecord | None:
        """The request of an id that was accepted and has not ended; it may not be on disk yet."""
        return self._waiting.get(request_id)

    def phase(self, request_id: str) -> str:
        """What the actor of a request does now; 'waiting' before its motion."""
        moving = self._moving
        if moving is None or moving.id != request_id:
            return 'waiting'
        return self._phase_of(moving.actor)

    def _record_of(self, request: MotionRequest) -> MotionRecord:
        # Names as the world file has them, where it has them.
        action = self._action_name(request.action)
        return MotionRecord(request.id, request.actor, self.world.label, request.object, action)

    def _run(self, request: MotionRequest, record: MotionRecord) -> StampedResult:
        if self._journal is None or not request.id:
            return self._move(request)
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

    def _write_late_ends(self) -> None:
        """Between motions: keep what could not be written when a motion ended."""
        if self._unwritten and time.monotonic() > self._next_write:
            self._write_ends()

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
            return self.world.action(action).name
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
            result, moved = self._perform(request)
        except Exception as error:
            self._on_error(error)
            message = f'The motion failed: {type(error).__name__}: {error}'
            return StampedResult(MotionOutcome.FAILED, message, started, self.now)
        finally:
            self._moving = None
        return StampedResult(*result, *((started, self.now) if moved else ()))

    def _wait_for_keeper(self) -> None:
        """A keeper that is late for a moment delays a motion; it does not refuse it."""
        deadline = time.monotonic() + KEEPER_PATIENCE
        while self.block is Block.UNHEARD and time.monotonic() < deadline:
            self._idle()

    def _view(self, name: str) -> ObjectView | None:
        return self.perceived.view(name, self.now)

    def _on_error(self, error: Exception) -> None:
        self.errors += 1
        self._report_error(error)

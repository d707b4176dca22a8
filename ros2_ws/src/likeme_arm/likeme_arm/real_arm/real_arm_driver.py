"""Carries out requests with a real arm."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from math import isfinite
from typing import NamedTuple

from likeme_arm.free_space import UNKNOWN_EXTENT, on_table
from likeme_arm.hold_monitor import Block, HoldMonitor
from likeme_arm.motion import PrimitiveResult, UnsafeMotionError
from likeme_arm.motion_driver import MotionDriver, MotionRequest
from likeme_arm.motion_journal import MotionJournal, MotionRecord
from likeme_arm.motion_stop import MotionStoppedError, stopped
from likeme_arm.primitives import check_names, check_target, execute_action, retreat
from likeme_arm.real_arm.arm_collisions import ArmCollisions, Obstacle
from likeme_arm.real_arm.arm_config import ArmConfig
from likeme_arm.real_arm.arm_kinematics import ArmKinematics
from likeme_arm.real_arm.arm_state import ArmState
from likeme_arm.real_arm.motion_fault import MotionFaultError
from likeme_arm.real_arm.planned_motion import Announce, NotAllowedError, PlannedMotion
from likeme_arm.real_arm.robot import (
    DryRobot,
    GripperController,
    Interruption,
    Robot,
    TrajectoryController,
)
from likeme_arm.real_arm.trajectory_check import TrajectoryCheck
from likeme_arm.tool_pose import NoSolutionError
from likeme_core.outcomes import Actor, MotionOutcome
from likeme_core.world import World

#: s between two looks at the hold while nothing moves.
IDLE_PERIOD = 0.02


class RealArmSettings(NamedTuple):
    """Settings of the driver.

    Attributes:
        budget: greatest duration of a request, s.
        table_state_timeout: greatest age of a table state that is acted on, s.
    """

    budget: float = 120.0
    table_state_timeout: float = 2.0


class Controllers(NamedTuple):
    """The arm's and the gripper's."""

    arm: TrajectoryController
    gripper: GripperController


class RealArmDriver(MotionDriver):
    """Plans, checks and carries out the primitives, one request at a time."""

    def __init__(
        self,
        world: World,
        config: ArmConfig,
        state: ArmState,
        controllers: Controllers | None,
        hold: HoldMonitor,
        settings: RealArmSettings,
        announce: Announce,
        on_error: Callable[[Exception], None],
        journal: MotionJournal | None = None,
        on_motion: Callable[[MotionRecord], None] = lambda _: None,
    ) -> None:
        """Build the arm's model; without controllers nothing moves: a dry run.

        Raises:
            ValueError: the configuration does not fit the URDF.
        """
        super().__init__(world, settings.table_state_timeout, on_error, journal, on_motion)
        self.config, self.state, self._settings = config, state, settings
        self._hold, self._closing = hold, False
        self._interruption = Interruption(lambda: self.block, lambda: hold.change)
        kinematics = ArmKinematics(config)
        self.collisions = ArmCollisions(kinematics, world.table)
        check = TrajectoryCheck(config, kinematics, self.collisions, world)
        self._robot: Robot | DryRobot = (
            DryRobot(config, state)
            if controllers is None
            else Robot(config, state, *controllers, self._interruption)
        )
        self.motion = PlannedMotion(kinematics, check, self._robot, self._obstacles, announce)
        self._target = ''
        # Whether anything was moved since the start; the last resume that was acted on.
        self._moved, self._last_change = False, 0

    @property
    def now(self) -> int:
        """System time, ns since the epoch."""
        return time.time_ns()

    @property
    def block(self) -> Block | None:
        """Why nothing may move; None: motion is allowed."""
        return Block.HELD if self._closing else self._hold.block

    @property
    def interrupted(self) -> bool:
        """Whether the motion under way must end now."""
        try:
            self._interruption.check()
        except MotionStoppedError:
            return True
        return False

    def hold(self) -> None:
        """Stop a running motion, and begin none."""
        self._closing = True

    def _phase_of(self, actor: Actor) -> str:
        return self.motion.phase

    def _perform(self, request: MotionRequest) -> tuple[PrimitiveResult, bool]:
        refused = self._refused(request)
        if refused is not None:
            return refused, False
        self._robot.moved = False
        self._target, self._last_change = request.object, self._hold.change
        self._interruption.begin(request.cancelled, self._settings.budget)
        if isinstance(self._robot, DryRobot):
            self._robot.begin()
        result = self._ended(lambda: self._act(request))
        self.motion.phase = 'rest'
        self._moved = self._moved or self._robot.moved
        return self._dry(result), self._robot.moved

    def _act(self, request: MotionRequest) -> PrimitiveResult:
        if not self.motion.at_home:
            retreat(self.motion, self.world.table, self.config.primitives)
        return execute_action(
            self.motion, self._view, self.world, request.object,
            self.world.action(request.action), self.config.primitives, self.perceived.others,
        )  # fmt: skip

    def _ended(self, motion: Callable[[], PrimitiveResult]) -> PrimitiveResult:
        """How a motion ends, whatever ends it."""
        try:
            return motion()
        except MotionStoppedError:
            return stopped(self._interruption.stopped_by, self._interruption.cancelled())
        except NotAllowedError:
            if self.interrupted:
                return stopped(self._interruption.stopped_by, self._interruption.cancelled())
            message = f'The motion was not allowed: it ended before {self.motion.phase}.'
            return PrimitiveResult(MotionOutcome.HELD, message)
        except MotionFaultError as error:
            message = f'The motion was stopped during {self.motion.phase}: {error}'
            return PrimitiveResult(MotionOutcome.FAILED, message)
        except (NoSolutionError, UnsafeMotionError) as error:
            message = f'The motion ended before {self.motion.phase}: {error}'
            return PrimitiveResult(MotionOutcome.FAILED, message)

    def _dry(self, result: PrimitiveResult) -> PrimitiveResult:
        """A dry run holds every motion: the plan is in the message."""
        if not isinstance(self._robot, DryRobot):
            return result
        plan = f'{self._robot.motions} motions of {self._robot.seconds:.1f} s were planned'
        message = f'Dry run, nothing moved: {plan}. {result.outcome.name}: {result.message}'
        return PrimitiveResult(MotionOutcome.HELD, message)

    def _refused(self, request: MotionRequest) -> PrimitiveResult | None:
        refused = check_names(self.world, request.object, request.action)
        if refused is not None:
            return refused
        block = self.block
        if block is not None:
            return PrimitiveResult(MotionOutcome.HELD, block.sentence)
        return check_target(self.world, request.object, self._view(request.object))

    def _idle(self) -> None:
        self._write_late_ends()
        time.sleep(IDLE_PERIOD)
        change = self._hold.change
        if self.block is None and change != self._last_change:
            # A person's resume lets the arm leave the table, as everywhere in the cell; once: if
            # that fails, the next request or resume tries again. Not before the first motion.
            self._last_change = change
            if not self._moved:
                return
            self._interruption.begin(lambda: False, self._settings.budget)
            result = self._ended(self._clear)
            if result.outcome is not MotionOutcome.COMPLETED:
                self._on_error(RuntimeError(f'The arm did not leave the table. {result.message}'))

    def _clear(self) -> PrimitiveResult:
        if not self.motion.at_home:
            retreat(self.motion, self.world.table, self.config.primitives)
        return PrimitiveResult(MotionOutcome.COMPLETED, 'The arm has left the table.')

    def _obstacles(self) -> Sequence[Obstacle]:
        """What the camera saw on the table, but for the object that is acted on."""
        return [
            Obstacle(
                name, view.x, view.y, view.yaw if isfinite(view.yaw) else 0.0,
                view.length or UNKNOWN_EXTENT, view.width or UNKNOWN_EXTENT,
                view.height or UNKNOWN_EXTENT,
            )
            for name, view in self.perceived.others(self._target).items()
            if on_table(self.world.table, view)
        ]  # fmt: skip

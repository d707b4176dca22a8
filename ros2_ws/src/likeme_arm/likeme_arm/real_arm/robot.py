"""An arm behind its controllers: sends one trajectory and watches it to its end."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Protocol

import numpy as np

from likeme_arm.hold_monitor import Block
from likeme_arm.motion_stop import MotionStoppedError
from likeme_arm.real_arm.arm_config import ArmConfig
from likeme_arm.real_arm.arm_state import ArmState, JointReading
from likeme_arm.real_arm.braking import find_stop
from likeme_arm.real_arm.motion_fault import MotionFaultError
from likeme_arm.real_arm.tracking import Tracking
from likeme_arm.real_arm.trajectory import Trajectory
from likeme_arm.tool_pose import Vector

#: Longest time between two looks at hold and joints, s.
CYCLE = 0.01
#: s for an arm to come to rest: before a motion, after it was stopped.
REST_TIMEOUT = 2.0
#: s for which a stopped arm must rest; how often it is told to stop.
REST, STOPS = 0.1, 3
#: s by which joint_states are late that seem to be of now.
STATE_DELAY = 0.1
#: Greatest way of a stop beyond its goal, as a share of its duration: then it has not arrived.
OVERSHOOT = 0.2
#: Places on the way where a stop may find the arm, and that are tried as its goal.
PLACES, GOALS = 30, 60
#: Fingers that move less than this share of their way for GRIPPER_REST s are at rest.
GRIPPER_STEP, GRIPPER_REST = 0.005, 0.3


class TrajectoryController(Protocol):
    """A joint trajectory controller."""

    def send(self, trajectory: Trajectory) -> None:
        """Begin a trajectory now.

        Raises:
            MotionFaultError: the controller is not there.
        """

    def stop(self, braking: Trajectory | None) -> None:
        """End the trajectory that was sent.

        braking: for controllers that need to be told how; None: it ends by itself as soon.
        """

    @property
    def failure(self) -> str | None:
        """Why the controller ended the trajectory, in a sentence; None: it has not, or well."""


class GripperController(Protocol):
    """The controller of a gripper."""

    def command(self, position: float) -> None:
        """Move its joint to a position."""


class Interruption:
    """What may end a motion at any time: hold, cancel, budget."""

    def __init__(self, block: Callable[[], Block | None], change: Callable[[], int]) -> None:
        """Set it up.

        Args:
            block: why nothing may move; None: motion is allowed.
            change: number of the last hold or resume.
        """
        self._block, self._change, self.stopped_by = block, change, None
        self.begin(lambda: False, float('inf'))

    def begin(self, cancelled: Callable[[], bool], budget: float) -> None:
        """A new motion, with s after which it is stopped."""
        self.cancelled, self.stopped_by = cancelled, None
        self._deadline = time.monotonic() + budget
        self._begun_at = self._change()

    def check(self) -> None:
        """To be called at every step.

        Raises:
            MotionStoppedError: nothing may move any more.
        """
        block = self._block()
        if block is None and self._change() != self._begun_at:
            # Held and resumed between two looks.
            block = Block.HELD
        if block is not None or self.cancelled() or time.monotonic() >= self._deadline:
            self.stopped_by = block
            raise MotionStoppedError

    stopped_by: Block | None


class Robot:
    """Moves an arm by its controllers. Nothing that was sent is sent again."""

    def __init__(
        self,
        config: ArmConfig,
        state: ArmState,
        controller: TrajectoryController,
        gripper: GripperController,
        interruption: Interruption,
    ) -> None:
        self._config, self._state, self._controller = config, state, controller
        self._gripper_controller, self._interruption = gripper, interruption
        self._closed = False
        self.moved = False

    @property
    def joints(self) -> Vector:
        """Measured joint angles, rad."""
        return self._state.read().joints

    def holding(self) -> bool:
        """Whether something keeps the closed fingers apart."""
        gripper = self._config.gripper
        width = gripper.width_at(self._state.read().gripper)
        return self._closed and width > gripper.empty_width

    def set_gripper(self, width: float, *, closed: bool) -> float:
        """Move the fingers until they rest; the width that remains, m.

        Raises:
            MotionFaultError: their joint is not told, or still moves after the gripper's timeout.
        """
        gripper = self._config.gripper
        self._interruption.check()
        self._closed, self.moved = closed, True
        self._gripper_controller.command(gripper.position(width))
        step = GRIPPER_STEP * abs(gripper.positions[0] - gripper.positions[1])
        began = since = self._state.now
        last = self._gripper_position()
        while (now := self._state.now) < began + gripper.timeout:
            self._state.wait(CYCLE)
            self._interruption.check()
            position = self._gripper_position()
            if abs(position - last) > step:
                last, since = position, now
            if now - since > GRIPPER_REST:
                return gripper.width_at(position)
        raise MotionFaultError(
            f'Expected the fingers at rest within {gripper.timeout:g} s, they still move.'
        )

    def follow(self, trajectory: Trajectory, until: Callable[[], bool] | None = None) -> bool:
        """Send a trajectory and watch it; whether `until` stopped it.

        Raises:
            MotionStoppedError: hold, cancel or budget stopped it.
            MotionFaultError: the arm or its controller failed; the trajectory was stopped.
        """
        self._wait_for_rest(MotionFaultError('Expected an arm at rest before a motion, it moves.'))
        self._interruption.check()
        self._check_start(trajectory)
        tracking = Tracking(trajectory, self._config)
        self.moved = True
        self._controller.send(trajectory)
        began = self._state.now
        try:
            while not self._step(trajectory, tracking, began):
                if until is not None and until():
                    break
            else:
                return False
        except BaseException:
            self._brake(trajectory, tracking, began)
            raise
        self._brake(trajectory, tracking, began)
        self._wait_for_rest(MotionFaultError('Expected the arm to come to rest, it moves.'))
        return True

    def _step(self, trajectory: Trajectory, tracking: Tracking, began: float) -> bool:
        self._state.wait(CYCLE)
        self._interruption.check()
        reading = self._state.read()
        failure = self._controller.failure
        if failure is not None:
            raise MotionFaultError(failure)
        return tracking.follow(self._state.now - began, reading)

    def _brake(self, trajectory: Trajectory, tracking: Tracking, began: float) -> None:
        """Stop on the trajectory's own path; again if the arm does not come to rest."""
        for _ in range(STOPS):
            sent = self._state.now
            braking = self._braking(trajectory, tracking, sent - began)
            self._controller.stop(braking)
            stop = braking or trajectory
            goal = trajectory.time_at(float(stop.s[-1]))
            latest = sent - began + self._config.tolerances.message_delay
            beyond = max(goal, latest) + OVERSHOOT * stop.duration
            if self._rests(stop, sent, beyond, tracking, began):
                return

    def _braking(
        self, trajectory: Trajectory, tracking: Tracking, elapsed: float
    ) -> Trajectory | None:
        """A stop from wherever the arm may be when it arrives; None: it ends by itself as soon."""
        config, path = self._config, trajectory.path
        delay, reading = config.tolerances.message_delay, self._last_reading()
        if reading is None:
            first = tracking.reached
            joints, speeds = trajectory.between(first, elapsed + delay, PLACES)
        else:
            first, last = tracking.about(elapsed, reading)
            # Readings are late, too.
            last = min(elapsed, last + self._state.age + STATE_DELAY)
            joints, speeds = trajectory.between(first, last + delay, PLACES)
            beside = reading.joints - joints[0]
            joints = np.vstack([joints, joints + beside, reading.joints])
            # Faster than it may be it was pushed, which is over by then.
            limit = config.max_velocity
            speeds = np.vstack([speeds, speeds, np.clip(reading.velocities, -limit, limit)])
        standing = reading is not None and reading.at_rest
        here = float(trajectory.s[trajectory.index_at(first)])
        goals = np.array([here]) if standing else np.linspace(here, path.length, GOALS)
        stop = find_stop(
            joints, speeds, path.at(goals), config.max_velocity, config.max_acceleration
        )
        if not standing and trajectory.duration - first <= stop.duration:
            return None
        return trajectory.to_rest(float(goals[stop.goal]), stop.duration)

    def _rests(
        self, braking: Trajectory, sent: float, beyond: float, tracking: Tracking, began: float
    ) -> bool:
        """Watch a stop; whether the arm rests and no message is on its way, as far as is told.

        sent: when. beyond: time of the trajectory at which the arm cannot be any more, s.
        """
        delay, since = self._config.tolerances.message_delay, self._state.now
        end = sent + delay + braking.duration + REST + STATE_DELAY
        while (now := self._state.now) < end:
            self._state.wait(CYCLE)
            reading = self._last_reading()
            if reading is not None and reading.at_rest:
                if now - since >= REST and now - sent >= delay:
                    return True
                continue
            since = self._state.now
            if reading is not None and tracking.about(since - began, reading)[0] > beyond:
                return False
        reading = self._last_reading()
        return reading is None or reading.at_rest

    def _check_start(self, trajectory: Trajectory) -> None:
        """It was planned and shown to a person meanwhile: the arm may have been moved."""
        apart = np.abs(self._state.read().joints - trajectory.joints[0])
        worst, limit = int(apart.argmax()), self._config.tolerances.goal
        if apart[worst] > limit:
            raise MotionFaultError(
                f'Expected {self._config.joints[worst]} within {limit:g} rad of where the motion '
                f'begins, got {apart[worst]:.3f} rad.'
            )

    def _last_reading(self) -> JointReading | None:
        try:
            return self._state.read()
        except MotionFaultError:
            return None

    def _wait_for_rest(self, fault: MotionFaultError) -> None:
        deadline = self._state.now + REST_TIMEOUT
        while not self._state.read().at_rest:
            self._interruption.check()
            if self._state.now > deadline:
                raise fault
            self._state.wait(CYCLE)

    def _gripper_position(self) -> float:
        position = self._state.read().gripper
        if not np.isfinite(position):
            raise MotionFaultError(
                f'Expected joint_states with {self._config.gripper.joint}, heard none.'
            )
        return position


class DryRobot:
    """Moves nothing: each trajectory counts as done when it was planned.

    Attributes:
        seconds, motions: duration and number of the trajectories since `begin`.
    """

    def __init__(self, config: ArmConfig, state: ArmState) -> None:
        self._config, self._state = config, state
        self.moved = False
        self.begin()

    def begin(self) -> None:
        """A new motion: from where the arm is, or from home if nothing is heard of it."""
        try:
            self.joints = self._state.read().joints
        except MotionFaultError:
            self.joints = self._config.home
        self._closed, self.seconds, self.motions = False, 0.0, 0

    def holding(self) -> bool:
        """Whether the fingers would hold something, as far as the plan knows."""
        return self._closed

    def set_gripper(self, width: float, *, closed: bool) -> float:
        """Nothing moves; the width that was asked for."""
        self._closed = closed
        return width

    def follow(self, trajectory: Trajectory, until: Callable[[], bool] | None = None) -> bool:
        """Nothing moves; the plan goes on from the trajectory's end."""
        self.joints = trajectory.joints[-1]
        self.seconds += trajectory.duration
        self.motions += 1
        return False

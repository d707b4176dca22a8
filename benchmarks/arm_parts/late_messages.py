"""A driver and a controller in simulated time, with messages that are late or lost."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from trajectory_msgs.msg import JointTrajectory

from likeme_arm.hold_monitor import Block
from likeme_arm.motion_stop import MotionStoppedError
from likeme_arm.real_arm.arm_config import ArmConfig
from likeme_arm.real_arm.arm_state import ArmState
from likeme_arm.real_arm.motion_fault import MotionFaultError
from likeme_arm.real_arm.robot import Interruption, Robot
from likeme_arm.real_arm.trajectory import Trajectory, joint_path, timed
from likeme_arm.ros.trajectory_controllers import braking_message, trajectory_message
from likeme_arm_sim.stand_in.trajectory_follower import Fault, TrajectoryFollower, spline_of

Vector = NDArray[np.float64]

#: s of a control step, and between two joint_states.
STEP, STATE_PERIOD = 0.004, 0.012
#: s by which an arm is behind what is commanded.
HARDWARE = 0.02
#: s at rest before a motion; s watched after the driver has ended it.
BEFORE, AFTER = 0.4, 4.0
#: Slower than this a joint rests, rad/s.
RESTING = 0.01
#: Of the table: s after the begin of a motion, s, factors on the speed limits.
HOLDS, DELAYS, SPEEDS = (
    (0.1, 0.4, 0.6, 0.9, 1.2, 1.6, 2.0),
    (0.0, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5),
    (1, 0.5),
)


class Conditions(NamedTuple):
    """What goes wrong.

    Attributes:
        hold_at: s after the motion's begin.
        start, stop: s until a trajectory, and a stop, reach the controller.
        lost: how many stops never do.
        paused: s before the hold in which the driver does not run.
        begins: from what a controller goes on: 'measured', 'desired', 'position' (without speeds).
        beside: how far the first joint stands from where the motion begins, rad.
        fault: of the controller.
    """

    hold_at: float = np.inf
    start: float = 0.0
    stop: float = 0.0
    lost: int = 0
    paused: float = 0.0
    begins: str = 'measured'
    beside: float = 0.0
    fault: Fault | None = None


class Course(NamedTuple):
    """What was commanded.

    Attributes:
        speed, acceleration: greatest share of a joint's limit.
        rest: s from the hold, or without one from the begin, to the end of the last motion.
        way, back: greatest way of a joint after the hold; of that towards the begin, rad.
        ended: how, in the driver's words.
    """

    speed: float
    acceleration: float
    rest: float
    way: float
    back: float
    ended: str


class LateArm(ArmState):
    """Controller and joint_states of an arm; its clock goes on while the driver waits."""

    failure: str | None = None

    def __init__(self, config: ArmConfig, joints: Vector, given: Conditions) -> None:
        self.time = 0.0
        super().__init__(config, lambda: self.time)
        self._arm, self._given, self._lost = config, given, given.lost
        self._follower = TrajectoryFollower(joints)
        self._follower.inject(given.fault)
        self._on_way = deque[tuple[float, JointTrajectory]]()
        self._due = 0.0
        #: time, joints, speeds, accelerations.
        self.commanded: list[tuple[float, Vector, Vector, Vector]] = []
        self.advance(BEFORE)
        self.began = self.time

    def send(self, trajectory: Trajectory) -> None:
        """Publish a trajectory."""
        self._publish(trajectory_message(trajectory, self._arm), self._given.start)

    def stop(self, braking: Trajectory | None) -> None:
        """Publish a stop."""
        if braking is None:
            return
        self._lost -= 1
        if self._lost < 0:
            self._publish(braking_message(braking, self._arm), self._given.stop)

    def wait(self, seconds: float) -> None:
        """Go on, and further if the driver does not run."""
        hold, now = self._given.hold_at, self.time - self.began
        if hold - self._given.paused <= now < hold:
            seconds = max(seconds, hold - now)
        self.advance(max(seconds, STEP))

    def advance(self, seconds: float) -> None:
        """Go on by some s."""
        for _ in range(round(seconds / STEP)):
            self.time += STEP
            while self._on_way and self._on_way[0][0] <= self.time:
                self._take_in(self._on_way.popleft()[1])
            follower = self._follower
            follower.advance(STEP)
            self.commanded.append(
                (self.time, follower.joints, follower.velocities, follower.accelerations)
            )
            if self.time >= self._due:
                self._due += STATE_PERIOD
                joints, speeds = self._measured()
                self.hear(self._arm.joints, joints.tolist(), speeds.tolist())

    def _publish(self, message: JointTrajectory, late: float) -> None:
        # Messages of one publisher come in the order in which they were sent.
        last = self._on_way[-1][0] if self._on_way else 0.0
        self._on_way.append((max(self.time + late, last), message))

    def _take_in(self, message: JointTrajectory) -> None:
        measured = None
        if self._given.begins != 'desired':
            joints, speeds = self._measured()
            measured = joints, speeds * (self._given.begins == 'measured')
        self._follower.replace(spline_of(message, self._arm.joints), measured)

    def _measured(self) -> tuple[Vector, Vector]:
        late = round(HARDWARE / STEP)
        before, joints = (
            each[1] for each in (2 * self.commanded[:1] + self.commanded)[-2 - late :][:2]
        )
        # Also of a joint that was pushed.
        return joints, (joints - before) / STEP


class NoGripper:
    """Not moved here."""

    def command(self, position: float) -> None:
        """Never called."""
        raise NotImplementedError


def course(config: ArmConfig, trajectory: Trajectory, given: Conditions) -> Course:
    """Carry out a trajectory by the driver."""
    start = trajectory.joints[0].copy()
    start[0] += given.beside
    arm = LateArm(config, start, given)
    interruption = Interruption(_held(arm, given.hold_at), lambda: 0)
    interruption.begin(lambda: False, np.inf)
    try:
        Robot(config, arm, arm, NoGripper(), interruption).follow(trajectory)
        ended = 'done'
    except MotionFaultError as error:
        ended = str(error)
    except MotionStoppedError:
        ended = 'held'
    arm.advance(AFTER)
    since = arm.began + (given.hold_at if np.isfinite(given.hold_at) else 0.0)
    time, joints, speeds, changes = (
        np.array(column) for column in zip(*arm.commanded, strict=True)
    )
    moving = time[np.abs(speeds).max(1) > RESTING]
    after = joints[time >= since]
    away = np.linalg.norm(after - start, axis=1)
    return Course(
        float((np.abs(speeds) / config.max_velocity).max()),
        float((np.abs(changes) / config.max_acceleration).max()),
        max(0.0, float(moving[-1] - since)) if len(moving) else 0.0,
        float(np.abs(after - after[0]).max()),
        float((np.maximum.accumulate(away) - away).max()),
        ended,
    )


def late_stops(config: ArmConfig) -> Iterator[tuple[float, float, Course]]:
    """Holds during a motion from home: factor on the speed limits, s of delay, what came of it."""
    for speed in SPEEDS:
        limits = config.max_velocity * speed, config.max_acceleration, config.max_jerk
        trajectory = timed(joint_path(config.home, config.ready), *limits).after(config.lead)
        for delay, hold, begins in product(DELAYS, HOLDS, ('measured', 'desired')):
            given = Conditions(hold_at=hold, stop=delay, begins=begins)
            yield speed, delay, course(config, trajectory, given)


def _held(arm: LateArm, hold_at: float) -> Callable[[], Block | None]:
    return lambda: Block.HELD if arm.time - arm.began > hold_at - STEP / 2 else None

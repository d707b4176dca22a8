"""What the driver of a real arm plans, checks and notices, without ROS and without an arm."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip('pinocchio', reason='scripts/real_arm.lock is not installed')
pytest.importorskip('ruckig')

from likeme_arm.motion import UnsafeMotionError
from likeme_arm.real_arm.arm_collisions import ArmCollisions, Obstacle
from likeme_arm.real_arm.arm_config import ArmConfig, load_arm_config, shipped_configs
from likeme_arm.real_arm.arm_kinematics import ArmKinematics
from likeme_arm.real_arm.arm_state import ArmState, JointReading
from likeme_arm.real_arm.braking import find_stop
from likeme_arm.real_arm.motion_fault import MotionFaultError
from likeme_arm.real_arm.tracking import Tracking
from likeme_arm.real_arm.trajectory import Trajectory, joint_path, timed
from likeme_arm.real_arm.trajectory_check import TrajectoryCheck
from likeme_arm.tool_pose import NoSolutionError, ToolPose
from likeme_core.paper_world import WORLD

OVER_TABLE = ToolPose(0.44, -0.1, 0.17, 0.3)


class Arm:
    """The Panda's model and checks."""

    def __init__(self) -> None:
        self.config = load_arm_config('panda')
        self.kinematics = ArmKinematics(self.config)
        self.collisions = ArmCollisions(self.kinematics, WORLD.table)
        self.check = TrajectoryCheck(self.config, self.kinematics, self.collisions, WORLD)

    def trajectory(self, goal: np.ndarray, factor: float = 1.0) -> Trajectory:
        """From home, at a multiple of the limits."""
        limits = self.config.max_velocity, self.config.max_acceleration, self.config.max_jerk
        path = joint_path(self.config.home, goal)
        return timed(path, *(factor * limit for limit in limits))


@pytest.fixture(scope='module')
def arm() -> Arm:
    return Arm()


@pytest.mark.parametrize('name', shipped_configs())
def test_a_shipped_configuration_fits_its_urdf(name: str) -> None:
    config = load_arm_config(name)
    kinematics = ArmKinematics(config)
    collisions = ArmCollisions(kinematics, WORLD.table)
    for joints in (config.home, config.ready):
        assert (kinematics.lower <= joints).all()
        assert (joints <= kinematics.upper).all()
        assert collisions.problem(joints, ()) is None
    # The tool points down over the table: its own height is what the pose says.
    ready = kinematics.tool_pose(config.ready)
    found = kinematics.inverse(ready._replace(z=ready.z - 0.01), config.ready, starts=4)
    assert kinematics.tool_pose(found).z == pytest.approx(ready.z - 0.01, abs=0.001)


@pytest.mark.parametrize('name', ['panda', 'so101'])
def test_the_grasp_point_is_between_the_fingers(name: str) -> None:
    config = load_arm_config(name)
    kinematics = ArmKinematics(config)
    collisions = ArmCollisions(kinematics, WORLD.table)
    places = collisions._place(config.ready)
    tool = kinematics._placement(config.ready)
    sides = []
    for link in config.finger_links:
        corners = np.vstack([
            (places[b.number].getRotation() @ b.corners.T).T + places[b.number].getTranslation()
            for b in collisions._bodies if b.link == link
        ])  # fmt: skip
        y, z = ((corners - tool.translation) @ tool.rotation).T[1:]
        sides.append((y[z > -0.03].min(), y[z > -0.03].max()))
    (_, right), (left, _) = sorted(sides)
    assert right < 1e-3
    assert left > -1e-3


def test_inverse_kinematics_comes_back_to_the_pose(arm: Arm) -> None:
    joints = arm.kinematics.nearest(OVER_TABLE)
    reached = arm.kinematics.tool_pose(joints)
    assert reached[:3] == pytest.approx(OVER_TABLE[:3], abs=0.001)
    assert np.sin(reached.yaw - OVER_TABLE.yaw) == pytest.approx(0.0, abs=0.01)


def test_what_lies_out_of_reach_has_no_solution(arm: Arm) -> None:
    with pytest.raises(NoSolutionError, match=r'x 1\.20, y 0\.00'):
        arm.kinematics.nearest(ToolPose(1.2, 0.0, 0.2, 0.0))


def test_a_trajectory_keeps_to_the_limits_and_ends_at_rest(arm: Arm) -> None:
    goal = arm.kinematics.nearest(OVER_TABLE)
    trajectory = arm.trajectory(goal)
    arm.check.check(trajectory, arm.config.home, ())
    assert trajectory.joints[-1] == pytest.approx(goal, abs=1e-6)
    assert not trajectory.velocities[-1].any()


def test_the_end_of_a_path_is_reached_at_the_end(arm: Arm) -> None:
    trajectory = arm.trajectory(arm.config.ready)
    assert trajectory.time_at(trajectory.path.length) == pytest.approx(
        trajectory.duration, abs=0.1
    )
    rounded = replace(trajectory, s=trajectory.s * (1 - 1e-12))
    assert rounded.time_at(trajectory.path.length) == trajectory.duration
    assert trajectory.time_at(0.0) == 0.0


@pytest.mark.parametrize(('factor', 'what'), [(3.0, 'speed'), (9.0, 'speed|acceleration')])
def test_a_faster_trajectory_is_refused(arm: Arm, factor: float, what: str) -> None:
    fast = arm.trajectory(arm.kinematics.nearest(OVER_TABLE), factor)
    with pytest.raises(UnsafeMotionError, match=f'Expected a ({what}) of panda_joint'):
        arm.check.check(fast, arm.config.home, ())


def test_a_trajectory_from_elsewhere_is_refused(arm: Arm) -> None:
    trajectory = arm.trajectory(arm.config.ready)
    with pytest.raises(UnsafeMotionError, match='from where the arm is'):
        arm.check.check(trajectory, arm.config.ready, ())


def test_a_joint_beyond_its_limit_is_refused(arm: Arm) -> None:
    beyond = arm.config.home.copy()
    beyond[0] = arm.kinematics.lower[0] - 0.1
    with pytest.raises(UnsafeMotionError, match=r'panda_joint1 within -2\.90 and 2\.90'):
        arm.check.check(arm.trajectory(beyond), arm.config.home, ())


def test_the_table_other_things_and_the_arm_itself_are_not_touched(arm: Arm) -> None:
    low = arm.trajectory(arm.kinematics.nearest(OVER_TABLE._replace(z=-0.02)))
    with pytest.raises(UnsafeMotionError, match='too near to the table'):
        arm.check.check(low, arm.config.home, ())
    pear = Obstacle('pear', 0.44, -0.1, 0.0, 0.07, 0.05, 0.06)
    there = arm.trajectory(arm.kinematics.nearest(OVER_TABLE._replace(z=0.03)))
    arm.check.check(there, arm.config.home, ())
    with pytest.raises(UnsafeMotionError, match='too near to the pear'):
        arm.check.check(there, arm.config.home, (pear,))
    folded = np.array([0.0, -1.7, 0.0, -3.0, 0.0, -0.0, 0.785])
    assert 'would touch' in str(arm.collisions.problem(folded, ()))


def test_the_persons_side_is_not_entered(arm: Arm) -> None:
    beyond = arm.trajectory(arm.kinematics.nearest(ToolPose(0.7, 0.0, 0.2, 0.0)))
    with pytest.raises(UnsafeMotionError, match=r'within x -0\.600 to 0\.720 m'):
        arm.check.check(beyond, arm.config.home, ())


def cubics(start: np.ndarray, speeds: np.ndarray, goal: np.ndarray, duration: float) -> np.ndarray:
    """To rest at a goal: speeds at 200 moments, and the accelerations there, (2, 200, J)."""
    u = np.linspace(0.0, 1.0, 200)[:, None]
    mean = (goal - start) / duration
    speed = speeds * (1 - 4 * u + 3 * u**2) + mean * (6 * u - 6 * u**2)
    change = (speeds * (6 * u - 4) + mean * (6 - 12 * u)) / duration
    return np.array([speed, change])


@pytest.mark.parametrize('factor', [1.0, 0.3])
@pytest.mark.parametrize('begin', [0.0, 0.4, 1.2])
@pytest.mark.parametrize('span', [0.0, 0.1, 0.6])
def test_a_stop_keeps_to_the_limits_wherever_the_arm_is_by_then(
    arm: Arm, factor: float, begin: float, span: float
) -> None:
    config = arm.config
    limits = config.max_velocity * factor, config.max_acceleration, config.max_jerk
    trajectory = timed(joint_path(config.home, config.ready), *limits)
    joints, speeds = trajectory.between(begin, begin + span, most=100)
    goals = trajectory.path.at(np.linspace(0.0, trajectory.path.length, 60))
    stop = find_stop(joints, speeds, goals, config.max_velocity, config.max_acceleration)
    assert stop.share <= 1.0
    # Nobody waits for longer than that to be told apart from a motion that goes on.
    assert stop.duration < 1.5
    for start, speed in zip(joints, speeds, strict=True):
        speed_at, change_at = np.abs(cubics(start, speed, goals[stop.goal], stop.duration))
        assert (speed_at <= config.max_velocity * (1 + 1e-9)).all()
        assert (change_at <= config.max_acceleration * (1 + 1e-9)).all()


def test_a_stop_that_cannot_keep_to_the_limits_breaks_them_least(arm: Arm) -> None:
    config = arm.config
    here = config.home[None]
    fast = 3 * config.max_velocity[None]
    stop = find_stop(here, fast, here, config.max_velocity, config.max_acceleration)
    assert stop.share == pytest.approx(3.0)


def at(trajectory: Trajectory, time: float, moves: bool = True) -> JointReading:
    index = trajectory.index_at(time)
    speed = trajectory.velocities[index] if moves else np.zeros(7)
    return JointReading(trajectory.joints[index].copy(), speed, 0.04)


def test_an_arm_that_follows_reaches_its_goal(arm: Arm) -> None:
    trajectory = arm.trajectory(arm.config.ready)
    tracking = Tracking(trajectory, arm.config)
    reached = [
        tracking.follow(t, at(trajectory, t - 0.1))
        for t in np.arange(0.0, trajectory.duration + 0.2, 0.02)
    ]
    assert reached[-1]
    assert not any(reached[: trajectory.index_at(trajectory.duration)])


def test_an_arm_that_stands_lags_or_leaves_its_way_is_noticed(arm: Arm) -> None:
    trajectory = arm.trajectory(arm.config.ready)

    def fault(reading: JointReading, elapsed: float = 1.5) -> str:
        tracking = Tracking(trajectory, arm.config)
        tracking.follow(0.9, at(trajectory, 0.9))
        with pytest.raises(MotionFaultError) as noticed:
            tracking.follow(elapsed, reading)
        return str(noticed.value)

    assert 'The arm stopped at 1.00 of' in fault(at(trajectory, 1.0, moves=False))
    assert 'at most 0.3 s behind its trajectory, got 0.50 s' in fault(at(trajectory, 1.0))
    beside = at(trajectory, 1.2)
    beside.joints[3] += 0.2
    assert 'Expected panda_joint4 within 0.1 rad' in fault(beside)


def test_an_arm_whose_speeds_are_noisy_rests_if_its_joints_stay(arm: Arm) -> None:
    now = [0.0]
    state, rng = ArmState(arm.config, lambda: now[0]), np.random.default_rng(1)

    def hear(speed: float) -> bool:
        now[0] += 0.01
        joints = arm.config.home + speed * now[0] + rng.uniform(-0.0005, 0.0005, 7)
        state.hear(arm.config.joints, joints.tolist(), [0.06] * 7)
        return state.read().at_rest

    still = [hear(0.0) for _ in range(14)]
    assert not any(still[:10])
    assert all(still[12:])
    assert not any([hear(0.06) for _ in range(20)][8:])


def test_old_joint_states_are_not_taken_for_the_present(arm: Arm) -> None:
    now = [0.0]
    state = ArmState(arm.config, lambda: now[0])
    with pytest.raises(MotionFaultError, match='heard none'):
        state.read()
    names, home = list(arm.config.joints), arm.config.home
    state.hear(names, home.tolist(), [])
    now[0] = 0.1
    state.hear([*names, 'other'], [*(home + 0.01).tolist(), 0.0], [])
    assert state.read().velocities == pytest.approx(np.full(7, 0.1))
    now[0] = 0.4
    with pytest.raises(MotionFaultError, match=r'at least every 0\.2 s, got none for 0\.30 s'):
        state.read()


@pytest.mark.parametrize(
    ('old', 'new', 'sentence'),
    [
        ('speed: 0.7', 'speed: -1', 'expected speed to be positive numbers, got -1'),
        ('speed: 0.7', 'sped: 0.7', 'expected speed, got none'),
        ('speed: 0.7', 'speed: 0.7\nhand: 1', 'got hand, which is not known'),
        ('base: [0, 0, 0, 0]', 'base: [0, 0]', 'expected base to be 4 numbers, got 0, 0'),
        ('kind: commands', 'kind: hydraulic', "commands or gripper_command, got 'hydraulic'"),
        ('z: [-0.05, 1.2]', 'z: [1.2, -0.05]', 'expected workspace.z from low to high'),
    ],
)
def test_a_bad_configuration_is_refused(tmp_path: Path, old: str, new: str, sentence: str) -> None:
    from likeme_arm.real_arm.arm_config import CONFIGS

    text = (CONFIGS / 'panda.yaml').read_text(encoding='utf-8')
    assert old in text
    path = tmp_path / 'mine.yaml'
    path.write_text(text.replace(old, new), encoding='utf-8')
    with pytest.raises(ValueError, match=r'mine\.yaml') as refused:
        load_arm_config(str(path))
    assert sentence in str(refused.value)


def test_a_joint_that_the_urdf_has_not_is_refused(arm: Arm) -> None:
    names = ('elbow', *arm.config.joints[1:])
    config: ArmConfig = replace(arm.config, joints=names)
    with pytest.raises(ValueError, match=r"panda_joint1.*got 'elbow'"):
        ArmKinematics(config)


def test_an_arm_that_is_not_shipped_is_refused() -> None:
    with pytest.raises(ValueError, match=r"an arm of panda, .* or a file, got 'hal'"):
        load_arm_config('hal')

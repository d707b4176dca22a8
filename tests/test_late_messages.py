"""What a controller commands when the messages of a real arm's driver are late, lost or old."""

from __future__ import annotations

from dataclasses import replace

import pytest

pytest.importorskip('ruckig', reason='scripts/real_arm.lock is not installed')

from arm_parts.late_messages import Conditions, Course, course
from likeme_arm.real_arm.arm_config import ArmConfig, load_arm_config
from likeme_arm.real_arm.trajectory import Trajectory, joint_path, timed
from likeme_arm_sim.stand_in.trajectory_follower import Fault, FaultKind

CONFIG = load_arm_config('panda')
#: As patient as on a loaded machine, where old readings are not noticed soon.
PATIENT = replace(
    CONFIG, tolerances=replace(CONFIG.tolerances, state_timeout=0.8, lag=1.2, goal_time=6.0)
)


def motion(config: ArmConfig = CONFIG, way: float = 2.0) -> Trajectory:
    """Of the first joint from home, with others for 2 rad."""
    goal = config.home + way / 2.0 * (config.ready - config.home)
    limits = config.max_velocity, config.max_acceleration, config.max_jerk
    return timed(joint_path(config.home, goal), *limits).after(config.lead)


def within_limits(found: Course) -> Course:
    assert found.speed <= 1.0
    assert found.acceleration <= 1.0
    return found


def test_a_motion_without_faults_is_commanded_as_planned() -> None:
    trajectory = motion()
    found = within_limits(course(CONFIG, trajectory, Conditions()))
    assert found.ended == 'done'
    assert found.rest == pytest.approx(trajectory.duration, abs=0.1)


@pytest.mark.parametrize('begins', ['measured', 'desired'])
@pytest.mark.parametrize('late', [0.0, 0.05, 0.2, 0.5])
@pytest.mark.parametrize('hold_at', [0.4, 0.8, 1.5])
def test_a_late_stop_breaks_no_limit(hold_at: float, late: float, begins: str) -> None:
    given = Conditions(hold_at=hold_at, stop=late, begins=begins)
    found = within_limits(course(CONFIG, motion(), given))
    assert found.ended == 'held'
    assert found.rest < 1.2 + late
    assert found.back < 0.08


@pytest.mark.parametrize('late', [0.0, 0.2, 0.5])
def test_an_arm_that_stands_is_told_to_stay(late: float) -> None:
    found = within_limits(course(CONFIG, motion(), Conditions(hold_at=0.1, stop=late)))
    assert found.ended == 'held'
    if not late:
        assert found.way < 0.001
    assert found.rest < 2.5


@pytest.mark.parametrize('late', [0.0, 0.5])
def test_a_controller_that_knows_no_speeds_keeps_to_them(late: float) -> None:
    found = course(CONFIG, motion(), Conditions(hold_at=1.0, stop=late, begins='position'))
    assert found.speed <= 1.0


@pytest.mark.parametrize('paused', [0.3, 1.0, 1.3])
@pytest.mark.parametrize('hold_at', [1.4, 2.5])
def test_a_driver_that_did_not_run_does_not_call_the_arm_back(
    hold_at: float, paused: float
) -> None:
    given = Conditions(hold_at=hold_at, paused=paused)
    found = within_limits(course(PATIENT, motion(), given))
    assert found.back < 0.03
    assert found.rest < 1.2


@pytest.mark.parametrize('late', [0.3, 0.6, 1.1])
def test_a_hold_ends_a_motion_that_began_late(late: float) -> None:
    given = Conditions(hold_at=0.9, start=late)
    found = within_limits(course(PATIENT, motion(), given))
    assert found.ended == 'held'
    # One that has hardly begun is taken back slowly.
    assert found.rest < 1.3 or found.way < 0.05


def test_a_stop_that_was_lost_is_sent_again() -> None:
    found = within_limits(course(CONFIG, motion(way=4.0), Conditions(hold_at=0.8, lost=1)))
    assert found.rest < 2.2
    assert found.way < 2.0


@pytest.mark.parametrize('begins', ['measured', 'desired'])
def test_an_arm_that_does_not_stand_quite_at_the_begin_is_not_rushed_there(begins: str) -> None:
    found = course(CONFIG, motion(), Conditions(beside=0.018, begins=begins))
    within_limits(found)
    assert found.ended == 'done'


def test_an_arm_that_was_moved_since_the_plan_is_not_moved() -> None:
    found = course(CONFIG, motion(), Conditions(beside=0.05))
    assert found.rest == 0.0
    assert found.ended == (
        'Expected panda_joint1 within 0.02 rad of where the motion begins, got 0.050 rad.'
    )


@pytest.mark.parametrize('begins', ['measured', 'desired'])
@pytest.mark.parametrize('amount', [0.2, -0.3])
@pytest.mark.parametrize('pushed_at', [0.5, 1.4, 2.6, 2.8])
def test_a_pushed_arm_is_stopped_within_its_limits(
    pushed_at: float, amount: float, begins: str
) -> None:
    fault = Fault(FaultKind.BUMP, 0, pushed_at, amount)
    found = within_limits(course(CONFIG, motion(), Conditions(begins=begins, fault=fault)))
    assert found.ended.startswith('Expected panda_joint1 within 0.1 rad of its trajectory')

"""That the stand-in's controller takes in trajectories as joint_trajectory_controller does."""

from __future__ import annotations

import numpy as np
import pytest

from likeme_arm_sim.stand_in.trajectory_follower import (
    Fault,
    FaultKind,
    Spline,
    TrajectoryFollower,
)

STEP = 0.01


def column(*values: float) -> np.ndarray:
    return np.array(values)[:, None]


def line(accelerations: np.ndarray | None = None) -> Spline:
    """At 1 rad/s, and to rest in the last second."""
    return Spline(
        np.array([0.5, 1.0, 2.0]), column(0.5, 1.0, 1.5), column(1.0, 1.0, 0.0), accelerations
    )


def ahead(follower: TrajectoryFollower, seconds: float) -> tuple[float, float]:
    for _ in range(round(seconds / STEP)):
        follower.advance(STEP)
    return float(follower.joints[0]), float(follower.velocities[0])


def test_without_a_stamp_it_starts_at_its_arrival_from_where_the_arm_is() -> None:
    follower = TrajectoryFollower(np.array([0.3]))
    assert follower.replace(line(), (np.array([0.1]), np.array([0.2])))
    joints, speed = ahead(follower, STEP)
    assert joints == pytest.approx(0.1 + 0.2 * STEP, abs=1e-3)
    assert speed == pytest.approx(0.2, abs=0.1)
    assert ahead(follower, 0.49) == pytest.approx((0.5, 1.0))
    assert ahead(follower, 1.5) == pytest.approx((1.5, 0.0))
    assert not follower.under_way


def test_with_a_stamp_it_is_in_phase_and_what_is_past_is_passed_over() -> None:
    follower = TrajectoryFollower(np.array([0.0]))
    assert follower.replace(line(), age=0.7)
    # At once where it is due, which is the danger of stamps.
    assert ahead(follower, STEP) == pytest.approx((0.71, 1.0))
    # Up to a first point that is to come it goes from where the arm is.
    assert follower.replace(line(), (np.array([0.2]), np.array([0.0])), age=0.3)
    assert ahead(follower, STEP)[0] == pytest.approx(0.2, abs=0.01)
    assert ahead(follower, 0.2 - STEP) == pytest.approx((0.5, 1.0))


def test_what_ends_in_the_past_or_moving_is_refused() -> None:
    follower = TrajectoryFollower(np.array([0.0]))
    assert follower.replace(line())
    assert not follower.replace(line(), age=2.1)
    assert not follower.replace(line()._replace(velocities=column(1.0, 1.0, 1.0)))
    assert ahead(follower, 0.5) == pytest.approx((0.5, 1.0))


def test_a_late_single_point_takes_the_arm_back() -> None:
    follower = TrajectoryFollower(np.array([0.0]))
    follower.replace(line())
    ahead(follower, 1.0)
    follower.replace(Spline(np.array([0.3]), column(0.5), column(0.0)))
    speeds = [ahead(follower, STEP)[1] for _ in range(30)]
    assert min(speeds) < -2.5
    assert follower.joints[0] == pytest.approx(0.5)


def test_accelerations_are_those_of_the_points() -> None:
    follower = TrajectoryFollower(np.array([0.0]))
    follower.replace(line(column(0.0, 0.4, 0.0)))
    ahead(follower, 1.0 - STEP)
    follower.advance(STEP)
    assert follower.accelerations[0] == pytest.approx(0.4, abs=1e-6)
    by_cubics = TrajectoryFollower(np.array([0.0]))
    by_cubics.replace(line())
    # p'' = (6 p0 - 6 p1 + 2 v0 + 4 v1) / w^2 at the end of a cubic.
    ahead(by_cubics, 1.0 - STEP)
    assert by_cubics.accelerations[0] == pytest.approx(0.0, abs=1e-6)
    ahead(by_cubics, 2 * STEP)
    assert by_cubics.accelerations[0] == pytest.approx(-1.0, abs=0.1)


def test_a_pushed_joint_is_where_the_next_trajectory_begins() -> None:
    follower = TrajectoryFollower(np.array([0.0]))
    follower.inject(Fault(FaultKind.BUMP, 0, 0.2, 0.3))
    follower.replace(line())
    joints, _ = ahead(follower, 0.3)
    assert joints > 0.4
    follower.replace(line())
    assert ahead(follower, STEP)[0] == pytest.approx(joints, abs=0.02)
    assert ahead(follower, 2.0) == pytest.approx((1.5, 0.0))

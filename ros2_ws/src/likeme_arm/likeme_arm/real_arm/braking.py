"""How an arm is stopped by a message of which nobody knows when it arrives.

A controller that gets a trajectory with one point goes there from where the arm is when the
message arrives, by a cubic in each joint, from the joint's speed to rest in the point's time. So
the point must suit every place on the way where the arm may be by then.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from likeme_arm.tool_pose import Vector

#: Durations that are tried, s. The shortest one is taken, or one up to SHORT whose way is less.
DURATIONS, SHORT = np.geomspace(0.1, 3.0, 50), 0.7


class Stop(NamedTuple):
    """Where to come to rest, and how long that takes.

    Attributes:
        goal: index into the goals.
        duration: s from the message's arrival.
        share: greatest share of a limit that may be reached; above 1: nothing that was tried keeps
            to the limits.
    """

    goal: int
    duration: float
    share: float


def find_stop(
    joints: Vector, speeds: Vector, goals: Vector, max_speed: Vector, max_acceleration: Vector
) -> Stop:
    """A stop that keeps to the limits from wherever the arm may be.

    joints, speeds: where it may be, (S, J), rad, rad/s; the first is the nearest to where it was.
    goals: where it may come to rest, (G, J), rad, in the order of the way.
    max_speed, max_acceleration: (J,), rad/s, rad/s^2.
    """
    way = goals[:, None] - joints
    onward, far = way[:, 0] @ speeds[0], speeds[0] @ speeds[0] / 3
    best: Stop | None = None
    least = Stop(0, float(DURATIONS[-1]), np.inf)
    for duration in map(float, DURATIONS):
        if best is not None and duration > max(best.duration, SHORT):
            break
        share = _shares(way, speeds, duration, max_speed, max_acceleration)
        # Nearer goals would have it go beyond and come back.
        enough = (onward >= far * duration) | (len(goals) == 1)
        fits = np.flatnonzero((share <= 1.0) & enough)
        if len(fits) and (best is None or fits[0] < best.goal):
            best = Stop(int(fits[0]), duration, float(share[fits[0]]))
        if share.min() < least.share:
            least = Stop(int(share.argmin()), duration, float(share.min()))
    return best or least


def _shares(
    way: Vector, speeds: Vector, duration: float, max_speed: Vector, max_acceleration: Vector
) -> Vector:
    """Greatest share of a limit in going to each goal, (G,)."""
    speed, acceleration = _greatest(way, speeds, duration)
    # A controller that does not know the joints' speeds takes them for 0.
    blind = 1.5 * np.abs(way) / duration
    share = np.maximum(np.maximum(speed, blind) / max_speed, acceleration / max_acceleration)
    return np.asarray(share.max((1, 2)))


def _greatest(way: Vector, speeds: Vector, duration: float) -> tuple[Vector, Vector]:
    """Greatest speed and acceleration of cubics over ways to rest, of the ways' shape."""
    first = (6 * way / duration - 4 * speeds) / duration
    last = (2 * speeds - 6 * way / duration) / duration
    # The acceleration is linear over time; the speed is greatest where that is 0, or at the begin.
    with np.errstate(divide='ignore', invalid='ignore'):
        zero = np.nan_to_num(first / (first - last))
    inside = np.where((zero > 0) & (zero < 1), zero, 0.0)
    turn = speeds + first * inside * duration / 2
    speed = np.maximum(np.abs(turn), np.abs(speeds))
    return speed, np.maximum(np.abs(first), np.abs(last))

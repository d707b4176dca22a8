"""Log messages of the gaze node."""

from __future__ import annotations

import math

import numpy as np

from likeme_gaze.mentor.mentor_tracker import GazeEstimate
from likeme_gaze.mentor.settings import LearningSettings, TrackingSettings


def model_trained(learning: LearningSettings, seconds: float) -> str:
    """What the gaze model was trained on, and how long that took."""
    return (
        f'Trained on {learning.points} simulated head movements in {seconds:.1f} s (seed '
        f'{learning.seed}, blindfold experience {learning.blindfold}).'
    )


def mentor_detected(estimate: GazeEstimate, settings: TrackingSettings) -> str:
    """Where a mentor stands at its start pose."""
    robot, mentor = estimate.robot, estimate.mentor_start
    away = math.hypot(mentor.x - robot.x, mentor.y - robot.y)
    eyes = 'covered' if settings.blindfolded else 'open'
    return f'Mentor at {away:.2f} m, eyes {eyes}: expecting {settings.observations} head poses.'


def goal_inferred(estimate: GazeEstimate) -> str:
    """The goal after the last observation, and the head command."""
    assert estimate.goal is not None, 'An estimate has a goal after the first observation.'
    (x, y), (dx, dy) = estimate.goal.mean, np.sqrt(np.diag(estimate.goal.covariance))
    return (
        f'Goal after {estimate.observations} observations: ({x:.2f} ± {dx:.2f}, {y:.2f} ± '
        f'{dy:.2f}) m; turning the head to {neck_direction(estimate.neck[0])}.'
    )


def neck_direction(angle: float) -> str:
    """An angle of the neck, rad, as text: '38.6 degrees left'."""
    return f'{abs(math.degrees(angle)):.1f} degrees {"left" if angle >= 0 else "right"}'

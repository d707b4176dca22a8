"""What the gaze node says to people."""

from __future__ import annotations

import math

import numpy as np

from likeme_gaze.mentor.settings import Blindfold, Learning, Watching
from likeme_gaze.mentor.watch import Answer

_KNOWN = {
    Blindfold.NONE: 'I know nothing of blindfolds',
    Blindfold.WINDOWED: 'I wore a blindfold with windows',
    Blindfold.OPAQUE: 'I wore an opaque blindfold',
}


def learned(learning: Learning, seconds: float) -> str:
    """What was learned, and from what."""
    return (
        f'I learned from {learning.points} movements of my own head in {seconds:.1f} s (seed '
        f'{learning.seed}). {_KNOWN[learning.blindfold]}.'
    )


def mentor_met(answer: Answer, settings: Watching) -> str:
    """Where a mentor stands when it is first seen."""
    robot, mentor = answer.robot, answer.mentor_start
    away = math.hypot(mentor.x - robot.x, mentor.y - robot.y)
    eyes = 'covered' if settings.blindfolded else 'open'
    return (
        f'A mentor {away:.2f} m away with its eyes {eyes}: I watch for {settings.observations} '
        'head poses.'
    )


def goal_found(answer: Answer) -> str:
    """What was inferred after the last observation."""
    assert answer.goal is not None, 'Only observations say something about a goal.'
    (x, y), (dx, dy) = answer.goal.mean, np.sqrt(np.diag(answer.goal.covariance))
    return (
        f'After {answer.observations} observations I believe that the mentor looks at '
        f'({x:.2f} ± {dx:.2f}, {y:.2f} ± {dy:.2f}) m and turn my head to {turned(answer.neck[0])}.'
    )


def turned(angle: float) -> str:
    """An angle of the neck, rad, in words: '38.6 degrees left'."""
    return f'{abs(math.degrees(angle)):.1f} degrees {"left" if angle >= 0 else "right"}'

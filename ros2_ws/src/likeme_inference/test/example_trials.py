"""Example trials."""

from __future__ import annotations

from likeme_core.outcomes import MotionOutcome
from likeme_core.paper_world import LEFT, PUSH_RIGHT, RIGHT
from likeme_core.tabletop import State
from likeme_inference.experience.trial import Pair, Place, Trial, TrialKey

PEAR = Pair('pear', LEFT, PUSH_RIGHT)


def trial(
    repetition: int = 0,
    pair: Pair = PEAR,
    x_f: State = RIGHT,
    robot: str = 'robot',
    campaign: str = 'test-1',
) -> Trial:
    key = TrialKey(robot, campaign, pair, repetition)
    before, after = Place(0.4, 0.1 + 1e-17, -1.5), None
    return Trial(
        key, x_f, MotionOutcome.COMPLETED, key.seed(1), '0.1.0', 10**18 + 1, before, after
    )

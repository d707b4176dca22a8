"""Predicted success beside what became of the actions."""

from __future__ import annotations

import math

import pytest

from likeme_core.outcomes import Actor, MotionOutcome
from likeme_core.paper_world import LEFT, PUSH_LEFT, RIGHT, WORLD
from likeme_inference.messages import calibration_msg
from likeme_inference.tabletop.calibration import Calibration
from likeme_inference.tabletop.promise import WINDOW, Promise
from likeme_inference.tabletop.values import Outcome, Result


def outcome(result: Result, actor: Actor = Actor.ROBOT, predicted: float = 0.8) -> Outcome:
    return Outcome(
        1, 'base_link', 7, 'pear', RIGHT, LEFT, LEFT, result, actor, PUSH_LEFT, predicted,
        MotionOutcome.COMPLETED, 'Said.',
    )  # fmt: skip


def test_actions_whose_end_was_seen_count() -> None:
    here = Calibration()
    for result in (Result.REACHED, Result.MISSED, Result.REACHED, Result.REACHED):
        here = here.after(outcome(result))
    assert (len(here.actions), here.promised, here.realised) == (4, pytest.approx(0.8), 0.75)
    assert here.sentence() == 'I promised 80% and kept 75% of my last 4 actions.'


@pytest.mark.parametrize(
    'ended',
    [
        outcome(Result.NOT_SEEN),
        outcome(Result.ARM_FAILED),
        outcome(Result.REACHED, Actor.HUMAN, math.nan),
        outcome(Result.SKIPPED, Actor.NOBODY, math.nan),
    ],
)
def test_other_ends_do_not_count(ended: Outcome) -> None:
    assert Calibration().after(ended) == Calibration()
    assert math.isnan(Calibration().realised)
    assert Calibration().sentence() == 'I have seen the end of no action yet.'


def test_the_latest_are_kept() -> None:
    here = Calibration()
    for k in range(WINDOW + 5):
        here = here.after(outcome(Result.REACHED if k >= 5 else Result.MISSED))
    assert (len(here.actions), here.realised) == (WINDOW, 1.0)


def test_a_promise_is_told_beside_it() -> None:
    promise = Promise(0.9, 0.5, recent=(True, True, True, False))
    message = calibration_msg(WORLD, Calibration(), promise, outcome(Result.REACHED))
    assert (message.target, message.kept, message.episodes, message.n) == (0.9, 0.75, 4, 0)
    assert message.sentence == 'I promised 90%, kept 75% of the last 4 times, help counting.'
    assert math.isnan(message.promised)

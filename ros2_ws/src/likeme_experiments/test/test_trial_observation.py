"""States and places read from a table observation, and motions that count as trials."""

from __future__ import annotations

import pytest

from likeme_core.outcomes import MotionOutcome
from likeme_core.paper_world import LEFT
from likeme_experiments.learning.trial_observation import (
    ObservedObject,
    ObservedTable,
    TrialVoidError,
    require_counted_motion,
    state_and_place,
)
from likeme_inference.experience.trial import Place
from likeme_inference.tabletop.values import MotionReport


def test_occluded_and_unknown_objects_void_the_trial() -> None:
    covered, seen = ObservedObject(None, None), ObservedObject(LEFT, Place(0.4, 0.1, 0.0))
    table = ObservedTable(1, True, {'pear': covered, 'lemon': seen})
    assert state_and_place(table, 'lemon') == (LEFT, seen.place)
    with pytest.raises(TrialVoidError, match='The pear stayed covered'):
        state_and_place(table, 'pear')
    with pytest.raises(TrialVoidError, match='The camera knows lemon, pear, not turnip'):
        state_and_place(table, 'turnip')


@pytest.mark.parametrize(
    'motion', [None, MotionOutcome.HELD, MotionOutcome.BUSY, MotionOutcome.EXPIRED]
)
def test_a_motion_that_does_not_count_voids_the_trial(motion: MotionOutcome | None) -> None:
    with pytest.raises(TrialVoidError, match='The arm did not try: because'):
        require_counted_motion(MotionReport(motion, 'because.'))

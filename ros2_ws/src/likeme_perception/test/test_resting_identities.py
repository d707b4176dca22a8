"""Identities of what rests while something else is taken away."""

from __future__ import annotations

import numpy as np
import pytest

from likeme_perception.identification import one_of_each
from likeme_perception.resting_identities import Resting, RestingIdentities

PERIOD = 100_000_000
PEAR, LEMON = Resting((0.4, 0.1), 0.003, False), Resting((0.4, -0.1), 0.002, False)
BOTH = np.array([[0.98, 0.01, 0.01], [0.01, 0.98, 0.01]])
ALONE = np.array([[0.30, 0.69, 0.01]])


def after_both() -> RestingIdentities:
    """Both have been seen in two frames."""
    resting = RestingIdentities()
    for k in range(2):
        resting.remembered(k * PERIOD, [PEAR, LEMON], BOTH)
    return resting


def test_what_is_left_is_what_it_was() -> None:
    resting = after_both()
    for k in range(2, 9):
        now = resting.remembered(k * PERIOD, [LEMON], ALONE)
        assert now[0, 1] > 0.98


@pytest.mark.parametrize(
    'blob',
    [
        LEMON._replace(place=(0.4, -0.12)),
        LEMON._replace(area=0.003),
        LEMON._replace(touched=True),
    ],
)
def test_what_moved_or_was_touched_is_told_anew(blob: Resting) -> None:
    resting = after_both()
    now = resting.remembered(2 * PERIOD, [blob], ALONE)
    assert now == pytest.approx(0.95 * ALONE + 0.05 / 3 if blob.touched else ALONE)
    assert resting.remembered(3 * PERIOD, [LEMON], ALONE) == pytest.approx(ALONE)


def test_what_was_not_seen_for_a_while_is_told_anew() -> None:
    assert after_both().remembered(9 * PERIOD, [LEMON], ALONE) == pytest.approx(ALONE)


def test_frames_of_the_same_objects_are_averaged_and_one_more_counts_alone() -> None:
    resting = RestingIdentities()
    for k, p in enumerate((0.9, 0.6)):
        row = np.array([[p, 0.9 - p, 0.1]])
        now = resting.remembered(k * PERIOD, [PEAR], row)
    assert now[0] == pytest.approx((0.75, 0.15, 0.1))
    now = resting.remembered(2 * PERIOD, [PEAR, LEMON], BOTH)
    assert now == pytest.approx(one_of_each(BOTH))


def test_what_a_hand_holds_is_not_what_rests() -> None:
    held = PEAR._replace(place=(0.4, 0.2), touched=True)
    alone = after_both().remembered(2 * PERIOD, [held], ALONE)
    both = after_both().remembered(2 * PERIOD, [held, LEMON], np.concatenate([ALONE, ALONE]))
    assert (alone[0].argmax(), both.argmax(axis=1).tolist()) == (1, [0, 1])
    assert both[1, 1] > 0.98 > both[0, 0]

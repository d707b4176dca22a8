"""Demonstrations out of scripted observations."""

from __future__ import annotations

from dataclasses import replace

import pytest

from likeme_core.observations import Demonstration
from likeme_core.tabletop import Manner, State
from likeme_perception.config import PerceptionConfig
from likeme_perception.hand_tip import HandTip
from likeme_perception.observation import ObjectObservation, TableObservation
from likeme_perception.regions import certain
from likeme_perception.segmentation import Shape
from likeme_perception.tracking import DemonstrationTracker

SECOND = 1_000_000_000
LEFT, RIGHT, OFF = (0.44, 0.18, 0.03), (0.44, -0.18, 0.03), (0.44, 0.50, -0.17)
HALFWAY, LIFTED = (0.44, 0.06, 0.03), (0.44, 0.06, 0.15)


def seen(name: str, place: tuple[float, float, float], settled: bool = True) -> ObjectObservation:
    """An object in view at a place."""
    _, y, z = place
    on_table = z > 0 and abs(y) < 0.33
    state = (State.LEFT if y > 0 else State.RIGHT) if on_table else State.OFFTABLE
    shape = Shape(place, 0.0, 0.07, 0.05, z + 0.03)
    return ObjectObservation(name, state, certain(state), True, settled, shape)


def covered(name: str) -> ObjectObservation:
    """An object under a hand or an arm."""
    return ObjectObservation(name)


def gone(name: str) -> ObjectObservation:
    """An object that is nowhere to be seen."""
    return ObjectObservation(name, State.OFFTABLE, certain(State.OFFTABLE), False, True)


class Script:
    """Feeds a tracker at 10 Hz and keeps what it finds."""

    def __init__(self) -> None:
        self.tracker = DemonstrationTracker(PerceptionConfig())
        self.stamp = 0
        self.acts: list[Demonstration] = []

    def show(
        self,
        *objects: ObjectObservation,
        hand: bool = False,
        arm: bool = False,
        tip: HandTip | None = None,
        seconds: float = 0.5,
    ) -> None:
        for _ in range(round(seconds * 10)):
            self.stamp += SECOND // 10
            now = TableObservation(
                self.stamp,
                'camera',
                hand_in_view=hand,
                arm_in_view=arm,
                objects=objects,
                hand_tip=tip,
            )
            self.acts += self.tracker.update(now)


@pytest.fixture
def script() -> Script:
    """A chicken at rest on the right, a pear at rest on the left."""
    s = Script()
    s.show(seen('chicken', RIGHT), seen('pear', LEFT))
    return s


def pear() -> ObjectObservation:
    """The bystander."""
    return seen('pear', LEFT)


def changes(script: Script) -> list[tuple[str, State, State]]:
    """What was found, without its numbers."""
    return [(a.object, a.x_i, a.x_f) for a in script.acts]


def test_a_place_is_seen_in_the_hand(script: Script) -> None:
    start = script.stamp
    script.show(seen('chicken', RIGHT), pear(), hand=True)
    script.show(seen('chicken', LIFTED, settled=False), pear(), hand=True)
    script.show(seen('chicken', LEFT, settled=False), pear(), hand=True)
    left = script.stamp
    script.show(seen('chicken', LEFT), pear(), seconds=1)
    assert changes(script) == [('chicken', State.RIGHT, State.LEFT)]
    act = script.acts[0]
    assert act.manner is Manner.PLACE
    assert act.manner_probability > 0.9
    assert act.rise == pytest.approx(0.12, abs=0.01)
    assert act.start == start + SECOND // 10
    assert act.end == left + SECOND // 10


def test_a_place_inside_the_fist_is_seen_by_the_hands_height(script: Script) -> None:
    script.show(seen('chicken', RIGHT), pear(), hand=True, tip=HandTip(0.44, -0.18, 0.20))
    for y, low in (
        (-0.18, 0.04),
        (-0.18, 0.10),
        (0.0, 0.15),
        (0.0, 0.15),
        (0.18, 0.10),
        (0.18, 0.04),
    ):
        tip = HandTip(0.44, y, low)
        script.show(covered('chicken'), pear(), hand=True, tip=tip, seconds=0.3)
    script.show(seen('chicken', LEFT), pear(), seconds=1)
    assert changes(script) == [('chicken', State.RIGHT, State.LEFT)]
    assert script.acts[0].manner is Manner.PLACE


def test_a_push_is_seen_sliding(script: Script) -> None:
    script.show(seen('chicken', RIGHT), pear(), hand=True, tip=HandTip(0.44, -0.25, 0.2))
    script.show(seen('chicken', HALFWAY, settled=False), pear(), hand=True)
    script.show(
        seen('chicken', LEFT, settled=False), pear(), hand=True, tip=HandTip(0.44, 0.1, 0.2)
    )
    script.show(seen('chicken', LEFT), pear(), seconds=1)
    assert script.acts[0].manner is Manner.PUSH
    assert script.acts[0].manner_probability > 0.9


def test_a_push_under_a_covering_hand_stays_low(script: Script) -> None:
    script.show(seen('chicken', RIGHT), pear(), hand=True, tip=HandTip(0.44, -0.18, 0.20))
    for y in (-0.18, -0.1, 0.0, 0.1, 0.18):
        tip = HandTip(0.44, y, 0.05)
        script.show(covered('chicken'), pear(), hand=True, tip=tip, seconds=0.3)
    script.show(covered('chicken'), pear(), hand=True, tip=HandTip(0.44, 0.18, 0.2))
    script.show(seen('chicken', LEFT), pear(), seconds=1)
    assert script.acts[0].manner is Manner.PUSH


def test_put_back_where_it_was_is_no_demonstration(script: Script) -> None:
    script.show(seen('chicken', LIFTED, settled=False), pear(), hand=True)
    script.show(seen('chicken', (0.40, -0.1, 0.03)), pear(), seconds=1)
    assert script.acts == []


def test_a_hand_that_passes_through_is_no_demonstration(script: Script) -> None:
    script.show(covered('chicken'), covered('pear'), hand=True)
    script.show(seen('chicken', RIGHT), pear(), seconds=1)
    assert script.acts == []
    assert not script.tracker.in_episode


def test_a_dropped_object_counts_where_it_comes_to_rest(script: Script) -> None:
    script.show(seen('chicken', LIFTED, settled=False), pear(), hand=True)
    script.show(seen('chicken', (0.44, 0.02, 0.10), settled=False), pear(), seconds=0.2)
    script.show(seen('chicken', (0.44, -0.02, 0.03), settled=False), pear(), seconds=0.4)
    assert script.acts == []
    script.show(seen('chicken', LEFT), pear(), seconds=0.5)
    assert changes(script) == [('chicken', State.RIGHT, State.LEFT)]


def test_pushed_off_the_table_and_out_of_view(script: Script) -> None:
    script.show(seen('pear', LEFT), seen('chicken', RIGHT), hand=True)
    script.show(seen('pear', (0.44, 0.28, 0.03), settled=False), seen('chicken', RIGHT), hand=True)
    script.show(seen('pear', (0.44, 0.35, 0.03), settled=False), seen('chicken', RIGHT), hand=True)
    script.show(replace(gone('pear'), settled=False), seen('chicken', RIGHT), hand=True)
    script.show(gone('pear'), seen('chicken', RIGHT), seconds=1)
    assert changes(script) == [('pear', State.LEFT, State.OFFTABLE)]
    assert script.acts[0].manner is Manner.PUSH


def test_carried_off_the_table_is_a_place(script: Script) -> None:
    script.show(seen('pear', (0.44, 0.18, 0.12), settled=False), seen('chicken', RIGHT), hand=True)
    script.show(seen('pear', (0.44, 0.30, 0.14), settled=False), seen('chicken', RIGHT), hand=True)
    script.show(covered('pear'), seen('chicken', RIGHT), hand=True)
    script.show(seen('pear', OFF), seen('chicken', RIGHT), seconds=1)
    assert changes(script) == [('pear', State.LEFT, State.OFFTABLE)]
    assert script.acts[0].manner is Manner.PLACE


def test_two_objects_are_two_acts_in_the_order_they_moved(script: Script) -> None:
    script.show(seen('chicken', RIGHT), seen('pear', HALFWAY, settled=False), hand=True)
    script.show(seen('chicken', HALFWAY, settled=False), seen('pear', RIGHT), hand=True)
    script.show(seen('chicken', LEFT), seen('pear', RIGHT), seconds=1)
    assert changes(script) == [
        ('pear', State.LEFT, State.RIGHT),
        ('chicken', State.RIGHT, State.LEFT),
    ]


def test_the_robots_own_acts_are_none(script: Script) -> None:
    script.show(covered('chicken'), pear(), arm=True)
    script.show(seen('chicken', LEFT), pear(), seconds=1)
    assert script.acts == []


def test_hand_and_arm_at_once_are_nobodys_act(script: Script) -> None:
    script.show(covered('chicken'), pear(), hand=True, arm=True)
    script.show(seen('chicken', LEFT), pear(), seconds=1)
    assert script.acts == []
    assert script.tracker.shared_acts == 1


def test_a_table_set_up_anew_is_none_and_the_next_act_starts_from_it(script: Script) -> None:
    script.show(seen('chicken', LEFT), pear(), seconds=1)
    assert script.acts == []
    script.show(covered('chicken'), pear(), hand=True)
    script.show(seen('chicken', RIGHT), pear(), seconds=1)
    assert changes(script) == [('chicken', State.LEFT, State.RIGHT)]


def test_a_hand_that_comes_back_before_all_rests_goes_on_with_the_same_act(script: Script) -> None:
    script.show(seen('chicken', HALFWAY, settled=False), pear(), hand=True)
    script.show(seen('chicken', HALFWAY, settled=False), pear(), seconds=0.2)
    script.show(seen('chicken', LEFT, settled=False), pear(), hand=True)
    script.show(seen('chicken', LEFT), pear(), seconds=1)
    assert changes(script) == [('chicken', State.RIGHT, State.LEFT)]


def test_what_never_rests_does_not_hold_up_the_rest(script: Script) -> None:
    script.show(covered('chicken'), pear(), hand=True)
    script.show(seen('chicken', LEFT), replace(pear(), settled=False), seconds=4.5)
    assert script.acts == []
    script.show(seen('chicken', LEFT), replace(pear(), settled=False), seconds=1)
    assert changes(script) == [('chicken', State.RIGHT, State.LEFT)]


def test_probabilities_travel_with_the_act(script: Script) -> None:
    unsure = replace(seen('chicken', LEFT), state_probability=(0.7, 0.2, 0.1))
    script.show(covered('chicken'), pear(), hand=True)
    script.show(unsure, pear(), seconds=1)
    assert script.acts[0].x_f_probability == (0.7, 0.2, 0.1)
    assert script.acts[0].x_i_probability == (0.0, 1.0, 0.0)

"""What perception last said."""

from __future__ import annotations

from likeme_arm.motion import ObjectView
from likeme_arm.perceived_objects import Sightings
from likeme_core.tabletop import State

SECOND = 1_000_000_000
PEAR = ObjectView(0.4, 0.1, 0.0, State.LEFT)


def test_a_table_state_is_believed_for_a_while() -> None:
    sightings = Sightings(timeout=2.0)
    assert sightings.look('pear', 5 * SECOND) is None
    assert sightings.age(5 * SECOND) == float('inf')
    sightings.take(5 * SECOND, {'pear': PEAR})
    assert sightings.look('pear', 7 * SECOND) == PEAR
    assert sightings.look('lemon', 7 * SECOND) is None
    assert sightings.look('pear', 7 * SECOND + 1) is None
    assert sightings.age(8 * SECOND) == 3.0


def test_what_was_seen_before_a_reset_is_not_believed() -> None:
    sightings = Sightings(timeout=2.0)
    sightings.take(5 * SECOND, {'pear': PEAR})
    sightings.forget(6 * SECOND)
    assert sightings.look('pear', 6 * SECOND) is None
    sightings.take(6 * SECOND, {'pear': PEAR})
    assert sightings.look('pear', 6 * SECOND) is None
    sightings.take(6 * SECOND + 1, {'pear': PEAR})
    assert sightings.look('pear', 7 * SECOND) == PEAR

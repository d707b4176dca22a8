"""What perception last said."""

from __future__ import annotations

from likeme_arm.motion import ObjectView
from likeme_arm.perceived_objects import PerceivedObjects
from likeme_core.tabletop import State

SECOND = 1_000_000_000
PEAR = ObjectView(0.4, 0.1, 0.0, State.LEFT)


def test_a_table_state_is_believed_for_a_while() -> None:
    perceived = PerceivedObjects(timeout=2.0)
    assert perceived.look('pear', 5 * SECOND) is None
    assert perceived.age(5 * SECOND) == float('inf')
    perceived.take(5 * SECOND, {'pear': PEAR})
    assert perceived.look('pear', 7 * SECOND) == PEAR
    assert perceived.look('lemon', 7 * SECOND) is None
    assert perceived.look('pear', 7 * SECOND + 1) is None
    assert perceived.age(8 * SECOND) == 3.0


def test_what_was_seen_before_a_reset_is_not_believed() -> None:
    perceived = PerceivedObjects(timeout=2.0)
    perceived.take(5 * SECOND, {'pear': PEAR})
    perceived.forget(6 * SECOND)
    assert perceived.look('pear', 6 * SECOND) is None
    perceived.take(6 * SECOND, {'pear': PEAR})
    assert perceived.look('pear', 6 * SECOND) is None
    perceived.take(6 * SECOND + 1, {'pear': PEAR})
    assert perceived.look('pear', 7 * SECOND) == PEAR

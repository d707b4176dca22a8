"""The last table state: age limit and reset."""

from __future__ import annotations

import pytest

from likeme_arm.motion import ObjectView
from likeme_arm.perceived_objects import PerceivedObjects
from likeme_core.paper_world import LEFT

SECOND = 1_000_000_000
PEAR = ObjectView(0.4, 0.1, 0.0, LEFT)


def test_a_table_state_is_used_up_to_its_timeout() -> None:
    perceived = PerceivedObjects(timeout=2.0)
    assert perceived.view('pear', 5 * SECOND) is None
    assert perceived.age(5 * SECOND) == float('inf')
    perceived.update(5 * SECOND, {'pear': PEAR}, 5 * SECOND)
    assert perceived.view('pear', 7 * SECOND) == PEAR
    assert perceived.view('lemon', 7 * SECOND) is None
    assert perceived.view('pear', 7 * SECOND + 1) is None
    assert perceived.age(8 * SECOND) == 3.0


def test_table_states_from_before_a_reset_are_ignored() -> None:
    perceived = PerceivedObjects(timeout=2.0)
    perceived.update(5 * SECOND, {'pear': PEAR}, 5 * SECOND)
    perceived.clear(6 * SECOND)
    assert perceived.view('pear', 6 * SECOND) is None
    perceived.update(6 * SECOND, {'pear': PEAR}, 6 * SECOND)
    assert perceived.view('pear', 6 * SECOND) is None
    perceived.update(6 * SECOND + 1, {'pear': PEAR}, 7 * SECOND)
    assert perceived.view('pear', 7 * SECOND) == PEAR


def test_a_table_state_from_the_future_is_refused() -> None:
    perceived = PerceivedObjects(timeout=2.0)
    perceived.update(6 * SECOND, {'pear': PEAR}, 5 * SECOND)
    with pytest.raises(ValueError, match=r'got one from 3600\.0 s later: the clocks'):
        perceived.update(3605 * SECOND, {'pear': PEAR}, 5 * SECOND)
    assert perceived.view('pear', 9 * SECOND) is None


def test_the_others_are_known_whatever_their_age() -> None:
    perceived = PerceivedObjects(timeout=2.0)
    assert perceived.others('pear') == {}
    perceived.update(5 * SECOND, {'pear': PEAR, 'unknown object 1': PEAR}, 5 * SECOND)
    assert perceived.others('pear') == {'unknown object 1': PEAR}
    assert perceived.view('pear', 60 * SECOND) is None
    assert perceived.others('lemon') == {'pear': PEAR, 'unknown object 1': PEAR}

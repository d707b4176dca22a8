from __future__ import annotations

from likeme_bringup.nearest_names import nearest

TOPICS = ['/decision', '/decision_record', '/demonstration', '/table_state', '/cell/hold_state']


def test_a_part_of_a_name_and_a_misspelling_find_it() -> None:
    assert nearest('Decison', TOPICS)[0] == '/decision'
    assert nearest('state', TOPICS)[:2] == ['/table_state', '/cell/hold_state']
    assert nearest('/hold_state', TOPICS, 1) == ['/cell/hold_state']
    assert nearest('xyzzy', TOPICS) == []

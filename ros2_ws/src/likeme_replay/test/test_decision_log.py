"""The same events give the same bytes, whatever library their numbers come from."""

from __future__ import annotations

import json
import math
from array import array
from types import SimpleNamespace

import numpy as np
import pytest

from likeme_replay.decision_log import LogEntry, LogEvent, entry_of_message, in_order, read_log


def test_numbers_read_the_same_wherever_they_come_from() -> None:
    stamp = SimpleNamespace(sec=3, nanosec=4)
    by_message = SimpleNamespace(
        header=SimpleNamespace(stamp=SimpleNamespace(sec=1, nanosec=2), frame_id='camera'),
        object='pear', x_i=np.uint8(1), posterior=array('d', [0.25, 1 / 3]), start=stamp, rise=0.1,
    )  # fmt: skip
    names = ['header', 'object', 'x_i', 'posterior', 'start', 'rise']
    by_value = LogEntry(
        LogEvent.DEMONSTRATION,
        1_000_000_002,
        {'frame_id': 'camera', 'object': 'pear', 'x_i': 1, 'posterior': (0.25, 1 / 3),
         'start': 3_000_000_004, 'rise': 0.1},
    )  # fmt: skip
    line = entry_of_message(LogEvent.DEMONSTRATION, by_message, names).line
    assert line == by_value.line
    assert json.loads(line)['posterior'] == [0.25, 0.333333333]


def test_the_last_bits_do_not_show_and_nan_is_null() -> None:
    lines = {
        LogEntry(LogEvent.OUTCOME, 0, {'p': value, 'none': math.nan}).line
        for value in (0.1 + 0.2, 0.3)
    }
    assert lines == {'{"event": "outcome", "stamp": 0, "p": 0.3, "none": null}'}


def test_a_belief_comes_before_the_decision_it_leads_to() -> None:
    decision, belief = LogEntry(LogEvent.DECISION, 5, {}), LogEntry(LogEvent.BELIEF, 5, {})
    assert in_order([decision, belief]) == [belief, decision]


def test_a_value_that_is_none_of_these_is_refused() -> None:
    with pytest.raises(TypeError, match='Expected a number'):
        _ = LogEntry(LogEvent.BELIEF, 0, {'x': object()}).line


def test_a_log_is_read_again_and_a_torn_one_refused() -> None:
    line = LogEntry(LogEvent.BELIEF, 7, {'goal': 1}).line
    assert list(read_log(f'{line}\n')) == [{'event': 'belief', 'stamp': 7, 'goal': 1}]
    with pytest.raises(ValueError, match='line 1'):
        list(read_log('{"event": "belief"}\n'))

"""Values of the configuration of another type: one sentence."""

from __future__ import annotations

import re
from contextlib import suppress
from dataclasses import fields
from typing import Any

import pytest

from likeme_perception.config import PerceptionConfig, config_from


@pytest.mark.parametrize(
    ('name', 'value', 'why'),
    [
        ('min_height', '0.01', "Expected min_height as a number, got '0.01'."),
        ('min_height', None, 'Expected min_height as a number, got None.'),
        ('min_height', True, 'Expected min_height as a number, got True.'),
        ('min_height', float('nan'), 'Expected min_height as a number, got nan.'),
        ('table', 5, 'Expected table as a list of 4 numbers, got 5.'),
        ('table', [1, 2, 3], 'Expected table as 4 numbers, got 3.'),
        ('table', [0, 1, 0, 'x'], "Expected table as a number, got 'x'."),
        ('camera_position', {'x': 1}, "as a list of 3 numbers, got {'x': 1}."),
        ('camera_quaternion', None, 'as a list of 4 numbers, got None.'),
        ('background_frames', 1.5, 'as a whole number, got 1.5.'),
        ('empty_at_start', 'no', "as true or false, got 'no'."),
        ('human_sides', 'far', "Expected human_sides as a list of names, got 'far'."),
        ('human_sides', [1], 'Expected human_sides as text, got 1.'),
        ('reference_frame', 3, 'Expected reference_frame as text, got 3.'),
    ],
)
def test_a_value_of_another_type(name: str, value: Any, why: str) -> None:
    with pytest.raises(ValueError, match=re.escape(why)):
        config_from({name: value})


@pytest.mark.parametrize(
    'name', [field.name for field in fields(PerceptionConfig) if field.name != 'world']
)
def test_a_setting_of_any_type_is_read_or_refused(name: str) -> None:
    values = [None, True, 0, -1, 10**400, 0.5, float('nan'), '', '1', [], [1.0], ['far'], {}]
    for value in [*values, [[1]] * 3, [None] * 4, {'x': 1}, b'1']:
        with suppress(ValueError):
            config_from({name: value})

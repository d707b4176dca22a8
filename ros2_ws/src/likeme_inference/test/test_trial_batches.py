"""Trials in parts by their time."""

from __future__ import annotations

from dataclasses import replace

import pytest
from example_trials import PEAR, trial

from likeme_core.paper_world import LEFT, OFFTABLE, RIGHT
from likeme_core.world import load_world
from likeme_inference.experience.trial import Pair
from likeme_inference.experience.trial_batches import batches_in_order

WORLD = load_world()


def test_parts_are_in_the_order_of_time() -> None:
    ends = [LEFT, LEFT, LEFT, OFFTABLE, RIGHT]
    made = [replace(trial(k, x_f=end), time=10 + k) for k, end in enumerate(ends)]
    lemon = Pair('lemon', RIGHT, PEAR.action)
    once = trial(0, pair=lemon, x_f=LEFT)
    parts = batches_in_order([*made[::-1], once], WORLD, ('lemon', 'pear'))

    at = 1, PEAR.x_i, PEAR.action
    assert parts[:, *at].tolist() == [[2, 0, 0], [1, 1, 1]]
    assert parts.sum() == 6
    assert parts[1, 0, RIGHT, PEAR.action, LEFT] == 1
    thirds = batches_in_order(made, WORLD, ('pear',), 3)
    assert thirds.sum(axis=(1, 2, 3, 4)).tolist() == [1, 2, 2]


def test_other_objects_are_left_out() -> None:
    assert batches_in_order([trial()], WORLD, ('lemon',)).sum() == 0
    with pytest.raises(ValueError, match='Expected at least 1 batch, got 0'):
        batches_in_order([trial()], WORLD, ('pear',), 0)

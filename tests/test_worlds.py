"""Random worlds through the simulated cell: seen, inferred, decided and acted, without a node."""

from __future__ import annotations

import pytest

from worlds_parts.world_run import run_world

pytestmark = pytest.mark.slow


@pytest.mark.parametrize('seed', [0, 2, 5])
def test_a_random_world_is_seen_inferred_and_acted_in(seed: int) -> None:
    """Three of the worlds of `bench.sh worlds`, with one object."""
    run = run_world(seed, count=1)
    assert run.failure == ''
    assert (run.seen, run.understood, run.consistent) == (run.objects, True, True)
    # The simulated arm may fail, but then it says so and the object is not at the goal.
    assert run.reached == (run.told == '')
    assert run.reached or not run.moved

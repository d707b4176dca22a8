"""Goal-based exploration: what practice does to a policy, and where it leads."""

from __future__ import annotations

import numpy as np
import pytest

from likeme_core.paper_world import PLACE_LEFT, PUSH_LEFT, WORLD
from likeme_inference.tabletop.goal_exploration import explore, explored_policy, reinforced
from likeme_inference.tabletop.goal_inference import direct_policy
from likeme_inference.tabletop.model_file import shipped

PEAR = shipped().objects['pear'].transition
CHICKEN = shipped().objects['chicken'].transition
L, R, O = WORLD.states  # noqa: E741


def test_success_raises_its_action_and_lowers_the_others() -> None:
    before = direct_policy(CHICKEN)
    after = reinforced(before, R, L, PLACE_LEFT, 0.1)

    assert after[R, L].sum() == pytest.approx(1)
    assert after[R, L, PLACE_LEFT] > before[R, L, PLACE_LEFT]
    assert after[R, L, PUSH_LEFT] < before[R, L, PUSH_LEFT]
    assert np.array_equal(np.delete(after, R, axis=0), np.delete(before, R, axis=0))
    assert before[R, L].tolist() == direct_policy(CHICKEN)[R, L].tolist()


def test_a_first_success_initialises_a_row() -> None:
    after = reinforced(direct_policy(PEAR), O, L, PUSH_LEFT, 0.1)

    assert after[O, L].tolist() == [0, 0, 0, 1, 0, 0]
    with pytest.raises(ValueError, match=r'step from 0 to 1, got 1\.5'):
        reinforced(after, O, L, 0, 1.5)


def test_practice_converges_to_the_explored_policy() -> None:
    """Geometrically in the mean, with a scatter that grows with the step."""
    limit = explored_policy(PEAR)
    scatter = []
    for step in (0.02, 0.1):
        runs = [explore(PEAR, PEAR, step, 600, np.random.default_rng(seed)) for seed in range(60)]
        late = np.array([run[-1] for run in runs])
        start, mean = runs[0][0], np.mean([run[150] for run in runs], axis=0)
        q, s = direct_policy(PEAR)[L, R], PEAR[L, :, R]
        share = (1 - step * (q @ s)) ** 150
        assert mean[L, R] == pytest.approx(
            limit[L, R] + share * (start[L, R] - limit[L, R]), abs=0.03
        )
        assert late.mean(axis=0) == pytest.approx(limit, abs=0.04)
        scatter.append(late.std(axis=0).max())
    assert scatter[0] < scatter[1] < 0.15


def test_exploration_in_a_different_world() -> None:
    """The robot believes in pushing the pear; in a world where only placing works it learns so."""
    world = PEAR.copy()
    world[R, PUSH_LEFT] = [0, 1, 0]
    world[R, PLACE_LEFT] = [1, 0, 0]
    believed = PEAR.copy()
    believed[R, PLACE_LEFT] = [0.1, 0.7, 0.2]
    practised = explore(believed, world, 0.05, 1000, np.random.default_rng(3))[-1]

    assert direct_policy(believed)[R, L].argmax() == PUSH_LEFT
    assert practised[R, L].argmax() == explored_policy(believed, world)[R, L].argmax()
    assert practised[R, L].argmax() == PLACE_LEFT


def test_goals_that_cannot_be_reached_stay_without_a_policy() -> None:
    assert not explored_policy(PEAR)[O, [L, R]].any()
    assert not explore(PEAR, PEAR, 0.1, 20, np.random.default_rng(0))[:, O, [L, R]].any()

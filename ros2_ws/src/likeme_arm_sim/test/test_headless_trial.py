"""Headless trials: causes of failure, and dependence on the seed alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from likeme_arm_sim.cell import Cell, CellSettings
from likeme_arm_sim.fitted_parameters import fitted_parameters, fitted_values
from likeme_arm_sim.headless_trial import (
    PerceptionNoise,
    SimulatedPerception,
    fitted_cell,
    run_trial,
    settings_from_parameters,
    single_object_cell,
    wait_until_at_rest,
    world_from_parameters,
)
from likeme_arm_sim.physics import Physics
from likeme_arm_sim.toys import toys_of
from likeme_core.outcomes import Actor, MotionOutcome
from likeme_core.paper_world import (
    LEFT,
    PLACE_LEFT,
    PLACE_RIGHT,
    PUSH_LEFT,
    PUSH_OFFTABLE,
    PUSH_RIGHT,
    RIGHT,
    WORLD,
)
from likeme_core.tabletop import Action, State

EXACT = PerceptionNoise(bias=(0.0, 0.0), noise=0.0, turn=0.0)
# An exact arm with a firm grip, low over the table: nothing is left to go wrong.
ABLE = {
    'arm_bias_x': 0.0,
    'arm_noise': 0.0,
    'reach': 0.7,
    'grip_force': 15.0,
    'grasp_height': 0.018,
    'release_height': 0.03,
    'place_share': 0.5,
    'push_gap': 0.03,
    'push_past': 0.03,
    'pear_friction': 0.45,
    'lemon_friction': 0.45,
    'push_off_heading': 0.0,
}


def cell(name: str, **changed: float) -> Cell:
    return fitted_cell(WORLD, name, fitted_values(WORLD) | ABLE | changed)


def outcomes(
    made: Cell, name: str, action: Action, seeds: int = 4
) -> list[tuple[State, MotionOutcome]]:
    start = LEFT if action.target == RIGHT else RIGHT
    tried = [run_trial(made, name, start, action, seed, error=EXACT) for seed in range(seeds)]
    return [(state, result.outcome) for state, result in tried]


def test_the_default_cell_uses_the_fitted_values() -> None:
    values = fitted_values(WORLD)
    made = settings_from_parameters(WORLD, values)
    assert made.physics.toys == {name: toy.physics for name, toy in toys_of(WORLD).items()}
    physics = replace(made.physics, toys={})
    assert physics == Physics()
    assert replace(made, physics=physics) == replace(CellSettings(), physics=Physics())
    assert world_from_parameters(WORLD, values).region_entries == WORLD.region_entries
    for name, parameter in fitted_parameters(WORLD).items():
        assert parameter.low <= parameter.value <= parameter.high, name


@pytest.mark.parametrize('action', [PLACE_LEFT, PUSH_LEFT])
def test_without_errors_every_action_succeeds(action: Action) -> None:
    # The chicken: round toys slip off even a well-placed pusher.
    assert outcomes(cell('chicken'), 'chicken', action) == [(LEFT, MotionOutcome.COMPLETED)] * 4


@pytest.mark.parametrize(
    ('name', 'changed'),
    [
        ('pear', {'grip_force': 0.5, 'pear_friction': 0.2}),
        ('lemon', {'grasp_height': 0.05}),
        ('lemon', {'arm_bias_x': 0.05}),
    ],
    ids=['too weak to lift it', 'closing on a sloped surface', 'beside it'],
)
def test_a_grasp_fails_for_a_reason(name: str, changed: dict[str, float]) -> None:
    ends = outcomes(cell(name, **changed), name, PLACE_LEFT)
    assert [outcome for _, outcome in ends] == [MotionOutcome.NOT_GRASPED] * 4
    assert LEFT not in [state for state, _ in ends]


def test_an_object_that_is_pushed_off_centre_slips_off() -> None:
    ends = outcomes(cell('lemon', arm_bias_x=0.035, push_gap=0.0), 'lemon', PUSH_RIGHT)
    assert [state for state, _ in ends].count(RIGHT) <= 1


def test_a_push_ends_where_the_arm_does() -> None:
    made = cell('chicken', reach=0.55)
    state, result = run_trial(made, 'chicken', RIGHT, PUSH_OFFTABLE, 3, error=EXACT)
    assert state == RIGHT
    assert result.outcome is MotionOutcome.NO_IK_SOLUTION
    assert result.message.startswith('The arm does not reach far enough to push the chicken.')


def rolled(height: float) -> float:
    """How far from where it was let go the lemon lies in the end, m, in the mean of 4."""
    made = cell('lemon', release_height=height, lemon_rolling=0.0002, arm_noise=0.006)
    ways = []
    for seed in range(4):
        run_trial(made, 'lemon', RIGHT, PLACE_LEFT, seed, error=EXACT)
        end = made.true_states()['lemon']
        ways.append(float(np.hypot(end.x - 0.44, end.y - 0.165)))
    return float(np.mean(ways))


def test_a_dropped_object_rolls_away() -> None:
    assert rolled(0.10) > rolled(0.03) + 0.01


def test_a_trial_depends_on_its_seed_alone() -> None:
    used, fresh = single_object_cell(WORLD, 'pear'), single_object_cell(WORLD, 'pear')
    for seed in range(3):
        run_trial(used, 'pear', LEFT, PLACE_RIGHT, seed)
    ends = [run_trial(made, 'pear', LEFT, PUSH_RIGHT, 9) for made in (used, fresh)]
    places = [made.true_states()['pear'] for made in (used, fresh)]
    assert ends[0][0] is ends[1][0]
    assert ends[0][1].message == ends[1][1].message
    assert np.hypot(places[0].x - places[1].x, places[0].y - places[1].y) < 1e-6


def test_a_trial_ends_where_it_does_beside_a_person() -> None:
    alone = single_object_cell(WORLD, 'lemon')
    beside = Cell(WORLD.only('lemon'), 0, CellSettings(initial_states={}))
    beside.arm.skip_free_space = True
    for action in (PLACE_RIGHT, PUSH_RIGHT):
        ends = [run_trial(made, 'lemon', LEFT, action, 4) for made in (alone, beside)]
        assert ends[0] == ends[1]
        assert alone.true_states() == beside.true_states()
    with pytest.raises(ValueError, match='Expected a hand that exists'):
        alone.run_action(Actor.HUMAN, 'lemon', PUSH_LEFT, alone.true_states().get)


def test_the_gripper_occludes_pushes_to_the_right_only() -> None:
    seen: dict[Action, list[bool]] = {PUSH_LEFT: [], PUSH_RIGHT: []}
    made = cell('chicken')
    for action, hidden in seen.items():
        eye = SimulatedPerception(made, 0)

        def watch(eye: SimulatedPerception = eye, hidden: list[bool] = hidden) -> None:
            if made.arm.tool.z < 0.03:
                hidden.append(eye.look('chicken').state is None)

        start = LEFT if action == PUSH_RIGHT else RIGHT
        run_trial(made, 'chicken', start, action, 1, on_tick=watch)
    assert np.mean(seen[PUSH_RIGHT]) > 0.8
    assert np.mean(seen[PUSH_LEFT]) < 0.1


def test_settling_ends_when_the_toy_is_at_rest() -> None:
    made = single_object_cell(WORLD, 'chicken')
    made.reset(['chicken'], [LEFT], 1)
    began = made.time
    wait_until_at_rest(made, 'chicken')
    assert made.time - began < 0.5

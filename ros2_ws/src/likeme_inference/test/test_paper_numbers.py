"""Table 1 and Fig 8 from the shipped trials, and the shipped trials against the authors' own."""

from __future__ import annotations

import csv
import os
from pathlib import Path

import pytest

from likeme_core.paper_world import WORLD
from likeme_core.tabletop import Manner, Mode, State
from likeme_inference.tabletop.action_selection import Choice, Kind, choose
from likeme_inference.tabletop.goal_inference import map_goal
from likeme_inference.tabletop.goal_model import GoalModel
from likeme_inference.tabletop.model_file import shipped

ROOT = Path(__file__).parents[4]
SHARED = Path(os.environ.get('LIKEME_SHARED', ROOT.parent / 'shared'))
REFERENCE = SHARED / 'data' / 'robot_counts.csv'
L, R, O = WORLD.states  # noqa: E741
CHANGES = [(L, R), (L, O), (R, L), (R, O)]
MODEL = shipped()
TABLE_1_MODES = (Mode.TRAJECTORY, Mode.GOAL_BASED, Mode.INTERACTIVE)

TABLE_1 = {
    (Manner.PLACE, 'pear'): (0.2250, 0.6750, 0.8250),
    (Manner.PLACE, 'lemon'): (0.5250, 0.6750, 0.6750),
    (Manner.PLACE, 'chicken'): (0.6500, 0.8000, 0.8000),
    # The paper prints 0.7250 for interactive here. Its own rule gives 0.8250, as in the row above:
    # what the interactive mode does and predicts does not depend on how the human acted.
    (Manner.PUSH, 'pear'): (0.6750, 0.6750, 0.8250),
    (Manner.PUSH, 'lemon'): (0.5750, 0.6750, 0.6750),
    (Manner.PUSH, 'chicken'): (0.7250, 0.8000, 0.8000),
}
MAP_ACTIONS = {
    'pear': ('PUSH_RIGHT', 'PUSH_OFFTABLE', 'PUSH_LEFT', 'PUSH_OFFTABLE'),
    'lemon': ('PLACE_RIGHT', 'PUSH_OFFTABLE', 'PUSH_LEFT', 'PLACE_OFFTABLE'),
    'chicken': ('PUSH_RIGHT', 'PLACE_OFFTABLE', 'PUSH_LEFT', 'PUSH_OFFTABLE'),
}
TWELVE = [(name, *change) for name in MAP_ACTIONS for change in CHANGES]


def shipped_model(name: str) -> GoalModel:
    return MODEL.goal_model(name)


def choice(name: str, x_i: State, goal: State, manner: Manner, mode: Mode) -> Choice:
    return choose(shipped_model(name), x_i, goal, WORLD.action_of(manner, goal), mode, 0.5)


def success(name: str, x_i: State, goal: State, manner: Manner, mode: Mode) -> float:
    """Table 1's hypothetical success: a human who is asked always succeeds."""
    made = choice(name, x_i, goal, manner, mode)
    return 1.0 if made.kind is Kind.ASK_HUMAN else made.predicted_success


@pytest.mark.parametrize(('manner', 'name'), TABLE_1)
def test_table_1(manner: Manner, name: str) -> None:
    means = [
        sum(success(name, *change, manner, mode) for change in CHANGES) / 4
        for mode in TABLE_1_MODES
    ]

    assert means == pytest.approx(TABLE_1[manner, name], abs=1e-12)


@pytest.mark.parametrize(('name', 'x_i', 'x_f'), TWELVE)
def test_the_true_goal_is_the_map_goal(name: str, x_i: State, x_f: State) -> None:
    posterior = shipped_model(name).goal_posterior(x_i, x_f)

    assert map_goal(posterior, x_f) == x_f
    assert posterior.sum() == pytest.approx(1)


@pytest.mark.parametrize(
    ('name', 'expected', 'tolerance'),
    [('pear', (0.0234388, 0.9684478, 0.0081134), 5e-8), ('lemon', (0.165, 0.635, 0.200), 5e-4)],
)
def test_goal_posteriors(name: str, expected: tuple[float, ...], tolerance: float) -> None:
    posterior = shipped_model(name).goal_posterior(L, R)

    assert posterior == pytest.approx(expected, abs=tolerance)


@pytest.mark.parametrize('name', MAP_ACTIONS)
def test_map_actions(name: str) -> None:
    chosen = [choice(name, *change, Manner.PLACE, Mode.GOAL_BASED).action for change in CHANGES]

    assert (
        tuple(WORLD.action(action).name for action in chosen if action is not None)
        == MAP_ACTIONS[name]
    )


def test_asks_only_for_pear_right_to_left() -> None:
    asked = [
        case
        for case in TWELVE
        if choice(*case, Manner.PUSH, Mode.INTERACTIVE).kind is Kind.ASK_HUMAN
    ]

    assert asked == [('pear', R, L)]
    assert choice('pear', R, L, Manner.PUSH, Mode.INTERACTIVE).predicted_success == 0.4


def test_no_prediction_lies_on_the_threshold() -> None:
    best = {choice(*case, Manner.PUSH, Mode.GOAL_BASED).predicted_success for case in TWELVE}

    assert 0.5 not in best


@pytest.mark.skipif(not REFERENCE.exists(), reason=f'{REFERENCE} is not here')
def test_shipped_trials_are_the_authors() -> None:
    with REFERENCE.open() as file:
        expected = [
            (r['object'], int(r['x_i']), int(r['action']),
             (int(r['left']), int(r['right']), int(r['offtable'])))
            for r in csv.DictReader(file)
        ]  # fmt: skip

    assert [row[:4] for row in shipped().rows] == expected
    assert sum(model.trials for model in MODEL.objects.values()) == 540

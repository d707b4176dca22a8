"""reproduce.sh: one JSON document and nothing else, the paper's numbers, pictures, refusals."""

from __future__ import annotations

import json
import subprocess
from contextlib import closing
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import cv2
import pytest
from typer.testing import CliRunner

from likeme_core.outcomes import MotionOutcome
from likeme_core.world import load_world
from likeme_experiments.commands.reproduce import app
from likeme_experiments.evaluation.fig8 import fig8
from likeme_experiments.reproductions import posterior, predictive_check, prior_sensitivity
from likeme_experiments.reproductions.fig8_statements import PAPER, statements_of
from likeme_experiments.reproductions.tabletop import REPRODUCTIONS
from likeme_inference.experience.store import ExperienceStore
from likeme_inference.experience.trial import Pair, Trial, TrialKey
from likeme_inference.tabletop import load_draws, model_file

ROOT = Path(__file__).parents[1]
EXPECTED_SUCCESS = {1: 0.7167, 2: 0.89, 3: 0.9525, 5: 0.9888}


def run(*words: str) -> Any:
    return CliRunner().invoke(app, list(words))


def document(*words: str) -> Any:
    answer = run(*words, '--json')
    assert answer.exit_code == 0, answer.output
    return json.loads(answer.stdout)


def test_table_1_except_the_misprint() -> None:
    rows = document('table1')['rows']
    differ = [
        (row['demonstration'], row['object'], mode, row[mode])
        for row in rows
        for mode in ('trajectory', 'goal_based', 'interactive')
        if abs(row[mode] - row['paper'][mode]) > 5e-5
    ]

    assert len(rows) == 6
    assert differ == [('push', 'pear', 'interactive', pytest.approx(0.825))]
    assert '17 of 18 cells as printed' in run('table1').stdout
    assert 'misprint' in run('table1').stdout


def test_fig_8() -> None:
    made = document('fig8')
    rows = made['rows']

    assert len(rows) == 12
    assert made['here'] == made['paper']
    assert all(row['goal'] == row['x_f'] for row in rows)
    assert [(row['object'], row['x_i'], row['x_f']) for row in rows if row['asks']] == [
        ('pear', 'RIGHT', 'LEFT')
    ]
    first = rows[0]
    assert first['goal_posterior'] == pytest.approx([0.0234388, 0.9684478, 0.0081134], abs=5e-8)
    assert (first['action'], first['predicted_success']) == ('PUSH_RIGHT', 1.0)
    assert first['predicted'] == [0.0, 1.0, 0.0]
    assert sum(first['action_posterior']) == pytest.approx(1)


def test_what_the_paper_says_of_fig_8_can_be_wrong_of_a_model() -> None:
    world = load_world()
    cases = fig8(model_file.shipped(), world)
    first = cases[0]
    # The second most preferred action of the pear from LEFT to RIGHT is aimed OFFTABLE.
    elsewhere = [
        0.9 if a.name == 'PUSH_RIGHT' else 0.1 * (a.name == 'PUSH_OFFTABLE') for a in world.actions
    ]
    wrong = first._replace(goal=first.x_i, action_posterior=tuple(elsewhere), asks=True)
    made = statements_of([wrong, *cases[1:]], world)
    assert made == (12, 11, 11, (('pear', 'LEFT', 'RIGHT'), ('pear', 'RIGHT', 'LEFT')))
    assert statements_of(cases, world) == PAPER


@pytest.mark.parametrize(
    'name',
    [
        'fig4', 'fig7', 'fig8', 'practice', 'sequential', 'joint', 'posterior', 'predictive-check',
        'prior-sensitivity',
    ],
)  # fmt: skip
def test_the_paper_is_named_beside_ours_at_80_columns(name: str) -> None:
    few = name in ('fig4', 'practice', 'joint', 'predictive-check')
    words = ['--seeds', '1'] if few else []
    told = run(name, *words).stdout
    assert 'the paper' in told.lower()
    assert max(map(len, told.splitlines())) <= 80


def test_fig_7_omits_self_transitions() -> None:
    rows = document('fig7')['rows']

    assert len(rows) == 3 * 2 * 4
    assert not [row for row in rows if row['action'].endswith(f'_{row["x_i"]}')]
    for row in rows:
        assert sum(row['probability']) == pytest.approx(1)
        for p, low, high in zip(row['probability'], row['low'], row['high'], strict=True):
            assert low - 1e-9 <= p <= high + 1e-9 or p in (0.0, 1.0)


def test_several_actions() -> None:
    rows = document('sequential')['rows']

    assert [row['actions'] for row in rows[::3]] == [1, 2, 3, 5, 10]
    for actions, expected in EXPECTED_SUCCESS.items():
        mine = [row for row in rows if row['actions'] == actions]
        assert sum(row['success'] for row in mine) / 3 == pytest.approx(expected, abs=5e-5)
        for row in mine:
            assert row['help_rate'] == pytest.approx(1 - row['success'])
            assert row['success_with_help'] == pytest.approx(1)
            # Who asks before it is hopeless asks at least as often.
            assert row['threshold_help_rate'] >= row['help_rate'] - 1e-12


def test_practice_converges_closer_with_smaller_steps() -> None:
    found = document('practice', '--seeds', '4')

    last = [distance[-1] for distance in found['distance']]
    assert found['steps'] == sorted(found['steps'])
    assert last == sorted(last)


def test_how_sure_goals_and_decisions_are() -> None:
    made = document('posterior')
    rows = made['rows']

    assert (made['chains'], made['draws'], len(rows)) == (4, 1000, 12)
    for row in rows:
        assert row['low'] < row['mean'] < row['high']
        # Ten trials decide the goal, and not always the action.
        assert row['same_goal'] > 0.99
    assert rows[0]['reference'] == pytest.approx(0.9684478, abs=5e-8)
    assert min(row['same_action'] for row in rows) < 0.75


def test_predictive_checks_of_the_papers_robot() -> None:
    checks = {
        check['name']: check for check in document('predictive-check', '--seeds', '5')['checks']
    }

    assert list(checks) == ['posterior', 'held out', 'shared', 'structured', 'pooled']
    assert [check['uses_trials_twice'] for check in checks.values()] == [True, *[False] * 4]
    assert [len(check['rows']) for check in checks.values()] == [36, 36, 36, 36, 12]
    assert all(checks[name]['overall'] > 0.05 for name in checks if name != 'pooled')
    # One model for all objects cannot have made these trials.
    assert checks['pooled']['overall'] < 0.001


def test_a_robot_that_changed_is_found_in_its_experience(tmp_path: Path) -> None:
    world, path = load_world(), tmp_path / 'store.sqlite'
    left, right, _ = world.states
    with closing(ExperienceStore(str(path), world)) as store:
        store.record(
            Trial(
                TrialKey('robot', 'by_hand', Pair(name, left, action), k),
                # From half of the trials on every action fails.
                right if k < 10 else left,
                MotionOutcome.COMPLETED, 1, '0.1.0', 1000 + k,
            )
            for name in ('pear', 'lemon') for action in world.actions for k in range(20)
        )  # fmt: skip
    found = document('predictive-check', '--model', str(path))
    overall = {check['name']: check['overall'] for check in found['checks']}

    assert found['batches'] == 2
    assert overall['order'] < 0.001
    assert overall['held out'] < 0.001


def test_what_depends_on_the_prior() -> None:
    made = document('prior-sensitivity')
    labels = [setting['label'] for setting in made['settings']]
    turning = [row['turning_point'] for row in made['rows']]

    assert made['reference'] == labels[0] == 'ML'
    assert all(row['goal'] == [row['x_f']] * len(labels) for row in made['rows'])
    assert not any(row['differs'][: labels.index('2') + 1].count(True) for row in made['rows'])
    assert sum(row['differs'][labels.index('10')] for row in made['rows']) == 10
    assert [turn is None for turn in turning].count(True) == 1
    assert min(turn['concentration'] for turn in turning if turn) == pytest.approx(2, rel=0.002)


def test_the_draws_are_written_beside_the_figure(tmp_path: Path) -> None:
    answer = run('posterior', '--out', str(tmp_path))

    assert answer.exit_code == 0
    assert load_draws(tmp_path / 'posterior.npz').posterior.counts.shape == (4, 1000, 3, 3, 6, 3)
    assert str(tmp_path / 'posterior.npz') in answer.stderr
    assert sorted(path.suffix for path in tmp_path.iterdir()) == ['.npz', '.png', '.svg']


@pytest.mark.skipif(find_spec('arviz') is None, reason='ArviZ is not installed (test.sh --extras)')
def test_the_draws_for_arviz(tmp_path: Path) -> None:
    assert run('posterior', '--arviz', '--out', str(tmp_path)).exit_code == 0
    assert (tmp_path / 'posterior.nc').stat().st_size > 0


def test_arviz_that_is_not_installed(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(posterior, 'find_spec', lambda _: None)
    answer = run('posterior', '--arviz', '--out', str(tmp_path))

    assert answer.exit_code == 1
    assert 'reproduce: posterior: expected the Python package arviz' in answer.stderr
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    'name',
    [
        *REPRODUCTIONS,
        *posterior.REPRODUCTIONS,
        *predictive_check.REPRODUCTIONS,
        *prior_sensitivity.REPRODUCTIONS,
    ],
)
def test_pictures(name: str, tmp_path: Path) -> None:
    answer = run(
        name,
        '--out',
        str(tmp_path / 'new'),
        *(['--seeds', '2'] if name in ('practice', 'predictive-check') else []),
    )

    assert answer.exit_code == 0
    picture = cv2.imread(str(tmp_path / 'new' / f'{name}.png'))
    assert picture is not None
    assert picture.std() > 10
    assert (tmp_path / 'new' / f'{name}.svg').read_text().rstrip().endswith('</svg>')


def test_another_model(tmp_path: Path) -> None:
    text = model_file.format_model(model_file.shipped())
    little = '\n'.join(
        line for line in text.splitlines() if 'pear' not in line and 'end' not in line
    )
    (tmp_path / 'model.csv').write_text(f'{little}\nend,36,360\n'.replace('_robot', '_little'))
    found = document('table1', '--model', str(tmp_path / 'model.csv'))

    assert [row['object'] for row in found['rows']] == ['lemon', 'chicken'] * 2
    assert found['model'] == 'chung2015_little 1'

    (tmp_path / 'plums.csv').write_text(text.replace('\npear', '\nplum'))
    said = run('table1', '--model', str(tmp_path / 'plums.csv')).stdout
    assert '12 of 12 cells as printed' in said
    assert 'nan' not in said


def test_a_model_without_objects(tmp_path: Path) -> None:
    shipped = model_file.format_model(model_file.shipped()).splitlines()
    header = shipped[: next(i for i, line in enumerate(shipped) if line.startswith('pear'))]
    (tmp_path / 'empty.csv').write_text('\n'.join([*header, 'end,0,0\n']))
    answer = run('practice', '--model', str(tmp_path / 'empty.csv'))

    assert answer.exit_code == 1
    assert 'expected rows of at least one object of the world' in answer.stderr


@pytest.mark.parametrize(
    ('words', 'code', 'said'),
    [
        (['fig9'], 2, 'reproduce: Expected one of table1, fig7, fig8, '),
        (['table1', '--seeds', '3'], 2, 'reproduce: table1 takes no --seeds.'),
        (['posterior', '--arviz'], 2, 'reproduce: --arviz needs --out.'),
        (['fig7', '--arviz', '--out', 'here'], 2, 'reproduce: fig7 takes no --arviz.'),
        (['table1', '--model', '/no/such/file'], 1, '/no/such/file: No such file'),
        (['table1', '--out', '/dev/null/x'], 1, 'Expected a folder to draw into, got /dev/null/x'),
    ],
)
def test_refusals(words: list[str], code: int, said: str) -> None:
    answer = run(*words)

    assert answer.exit_code == code
    assert said in answer.stderr
    assert answer.stdout == ''


def test_the_script_from_another_folder(tmp_path: Path) -> None:
    command = [ROOT / 'scripts' / 'reproduce.sh', 'table1', '--json', '--out', 'here']
    told = subprocess.run(
        command, cwd=tmp_path, capture_output=True, text=True, timeout=120, check=True
    )

    assert len(json.loads(told.stdout)['rows']) == 6
    assert (tmp_path / 'here' / 'table1.png').exists()


def test_tables_of_the_paper_fit_a_terminal_of_80_columns() -> None:
    for name in ('table1', 'fig7', 'fig8', 'sequential', 'practice'):
        assert max(map(len, run(name).stdout.splitlines())) <= 80, name

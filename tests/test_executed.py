"""Imitation carried out in process: the same by seed however it is made, kept, counted, drawn."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import cv2
import pytest
from typer.testing import CliRunner, Result

from likeme_core.tabletop import Action, Manner, Mode, State
from likeme_experiments.evaluation.episode import Act, Episode
from likeme_experiments.evaluation.forecast import Case
from likeme_experiments.imitation import episodes
from likeme_experiments.imitation.episode_log import Journal, fingerprint
from likeme_experiments.imitation.episodes import Task, make_episode, tasks
from likeme_experiments.imitation.imitation_cell import Stage
from likeme_experiments.learning import self_taught_model as learning
from likeme_experiments.learning.trial_cell import simulated_robot
from likeme_experiments.reproduce import app
from likeme_experiments.reproductions.models import model_of
from likeme_experiments.reproductions.report import Options
from likeme_inference.tabletop.model_file import format_model, shipped
from likeme_inference.tabletop.robot_model import RobotModel

TEXT = format_model(shipped())
WAYS = ('trajectory', 'goal_based', 'interactive', 'sequential', 'sequential_with_help')
BACK = Task(Case('lemon', State.RIGHT, State.LEFT, Manner.PUSH), 1)
#: The pear from RIGHT to LEFT is what the paper's robot asks for.
ASKED = Task(Case('pear', State.RIGHT, State.LEFT, Manner.PLACE), 0)


@pytest.fixture(scope='module')
def lemon_back() -> Episode:
    return make_episode(BACK, TEXT)


def run(*words: str) -> Result:
    return CliRunner().invoke(app, list(words))


def only(name: str) -> RobotModel:
    known = shipped()
    rows = tuple(row for row in known.rows if row.object == name)
    return RobotModel(f'only_{name}', '1', known.sources, rows)


def test_a_stage_gives_the_same_answer_whatever_it_was_asked_before() -> None:
    push, place = Action.PUSH_RIGHT, Action.PLACE_RIGHT
    wandering = Stage('lemon', State.LEFT, 7)
    wandering.act((), place)
    first = wandering.act((), push)
    wandering.help((), State.RIGHT)
    straight = Stage('lemon', State.LEFT, 7)
    assert straight.beginning == wandering.beginning
    assert straight.act((), push) == first
    done = wandering.act((push,), place)
    assert straight.act((push,), place) == done
    assert straight.carried_out == 3
    assert wandering.act((push,), place) is done
    assert done.view.stamp > first.view.stamp > first.report.finished > 0


def test_an_episode_is_a_function_of_task_and_model(lemon_back: Episode) -> None:
    asked = make_episode(ASKED, TEXT)
    assert make_episode(BACK, TEXT) == lemon_back
    assert asked.understood
    assert lemon_back.acts == (Act(State.RIGHT, State.LEFT, Manner.PUSH),)
    for endings in asked.endings.values():
        assert endings[Mode.TRAJECTORY].actions == (Action.PLACE_LEFT,)
        interactive = endings[Mode.INTERACTIVE]
        assert (interactive.asked, interactive.actions) == (True, ())
        assert interactive.helped == State.LEFT
        assert endings[Mode.GOAL_BASED].actions == (Action.PUSH_LEFT,)
        assert endings[Mode.SEQUENTIAL].states[0] == endings[Mode.GOAL_BASED].states[0]
    assert {len(e[Mode.TRAJECTORY].actions) for e in lemon_back.endings.values()} == {1}


def test_every_task_has_its_own_chance() -> None:
    wanted = tasks(('pear', 'lemon', 'chicken'), 2)
    seeds = {task.chance(purpose) for task in wanted for purpose in ('shown', 'put back')}
    assert (len(wanted), len(seeds)) == (48, 96)


@pytest.fixture(scope='module')
def lemons(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A model of the lemon alone."""
    path = tmp_path_factory.mktemp('model') / 'lemon.csv'
    path.write_text(format_model(only('lemon')))
    return path


@pytest.mark.slow
def test_the_table_stopped_and_gone_on_with_by_other_workers(
    lemons: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv('LIKEME_ROOT', str(tmp_path))
    monkeypatch.setattr(episodes, 'tasks', lambda *given: tasks(*given)[1::2])
    words = ['table1-executed', '--model', str(lemons), '--seeds', '1', '--json']
    first = run(*words, '--workers', '2', '--out', str(tmp_path / 'drawn'))
    assert first.exit_code == 0, first.output
    (journal,) = (tmp_path / 'out' / 'table1-executed').iterdir()
    lines = journal.read_text().splitlines(keepends=True)
    assert len(lines) == 4
    # As a power-off leaves it: two lines whole, one torn.
    journal.write_text(''.join(lines[:2]) + lines[2][:40])
    assert run(*words, '--workers', '1').stdout == first.stdout
    _check_document(json.loads(first.stdout))
    picture = cv2.imread(str(tmp_path / 'drawn' / 'table1-executed.png'))
    assert picture is not None
    assert picture.std() > 10


def _check_document(document: dict[str, Any]) -> None:
    rows = document['rows']
    assert [(row['demonstration'], row['object']) for row in rows] == [
        ('place', 'lemon'), ('push', 'lemon'),
    ]  # fmt: skip
    for row in rows:
        for way in WAYS:
            cell = row[way]
            assert cell['low'] <= cell['success'] <= cell['high']
            assert cell['n'] == 2
    # LEFT to OFFTABLE and RIGHT to OFFTABLE by PLACE_OFFTABLE: 5 and 7 of 10, and the prior.
    assert rows[0]['trajectory']['predicted'] == pytest.approx((5.09 + 7.09) / 2 / 10.27)
    shown = document['demonstrations']
    assert shown['shown'] == 4
    assert shown['understood'] + shown['misread'] + shown['not_seen'] == 4
    assert len(document['by_change']) == 4 * 4
    cells = document['calibration']['cells']
    assert sum(cell['n'] for cell in cells) >= 4
    inside = [c['inside'] for c in document['by_change'] if not c['asks']]
    assert document['calibration']['inside'] == pytest.approx(sum(inside) / len(inside))
    for bar in document['bars'].values():
        compare = {'>=': float.__ge__, '>': float.__gt__, '<': float.__lt__}[bar['rule']]
        assert bar['met'] == compare(bar['measured'], bar['bar'])


def test_a_journal_is_of_one_model(tmp_path: Path, lemon_back: Episode) -> None:
    Journal(tmp_path, TEXT).add(lemon_back)
    assert list(Journal(tmp_path, TEXT).episodes.values()) == [lemon_back]
    assert not Journal(tmp_path, format_model(only('pear'))).episodes
    assert fingerprint(TEXT) == fingerprint(TEXT)


def test_a_robot_teaches_itself_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    place = str(tmp_path / 'experience.sqlite')

    def taught() -> RobotModel:
        return learning.self_taught(1, 5, 1, ('lemon',), place)

    model = taught()
    assert model.label == 'self_taught 18'
    assert list(model.sources) == [f'{simulated_robot()}/offline-5']
    monkeypatch.setattr(learning, 'learn_locally', lambda *_: pytest.fail('It knows all that.'))
    assert format_model(taught()) == format_model(model)
    stored = model_of(Options(model=place))
    assert stored.rows == model.rows


def test_fig_7_beside_the_real_robot_s(tmp_path: Path) -> None:
    path = tmp_path / 'model.csv'
    path.write_text(TEXT.replace('chung2015_robot', 'another'))
    answer = run('fig7', '--model', str(path), '--json', '--out', str(tmp_path))
    assert answer.exit_code == 0, answer.output
    document = json.loads(answer.stdout)
    assert document['model'] == 'another 1'
    assert document['beside'] == {'model': shipped().label, 'rows': document['rows']}
    assert (tmp_path / 'fig7.png').exists()
    assert f'in brackets {shipped().label}' in run('fig7', '--model', str(path)).stdout


def test_exploration_says_which_worlds(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(learning, 'self_taught', lambda *_: shipped())
    answer = run('exploration', '--model', 'learned', '--seeds', '1', '--out', str(tmp_path))
    assert answer.exit_code == 0, answer.output
    assert 'World: simulated_cell 1 (540 trials); 1 seeds' in answer.stdout
    assert 'World: chung2015_robot 1 (540 trials); 1 seeds' in answer.stdout
    assert (tmp_path / 'exploration.png').exists()


@pytest.mark.parametrize(
    ('words', 'code', 'said'),
    [
        (['table1-executed', '--seeds', '0'], 2, 'Invalid value'),
        (['table1-executed', '--model', '/no/such/file'], 1, '/no/such/file: No such file'),
        (['table1', '--model', 'sqlite:////no/such/store'], 1, 'reproduce: table1: '),
    ],
)
def test_refusals(words: list[str], code: int, said: str) -> None:
    answer = run(*words)
    assert answer.exit_code == code
    assert said in ' '.join(answer.stderr.split())
    assert answer.stdout == ''


def test_a_model_of_things_the_cell_has_not(tmp_path: Path) -> None:
    path = tmp_path / 'model.csv'
    path.write_text(format_model(only('pear')).replace('pear', 'turnip'))
    answer = run('table1-executed', '--model', str(path))
    assert answer.exit_code == 1
    assert "Expected a model of pear, lemon, chicken, got one of ['turnip']." in answer.stderr

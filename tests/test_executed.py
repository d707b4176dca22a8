"""Executed imitation: episodes are deterministic, logged, scored and drawn."""

from __future__ import annotations

import json
import shutil
from importlib.resources import files
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner, Result

from likeme_arm_sim.cell import Cell
from likeme_core.paper_world import (
    LEFT,
    PLACE_LEFT,
    PLACE_RIGHT,
    PUSH_LEFT,
    PUSH_RIGHT,
    RIGHT,
    WORLD,
)
from likeme_core.tabletop import Manner, Mode
from likeme_experiments.commands.reproduce import app
from likeme_experiments.evaluation.episode import ImitationEpisode, PerceivedDemonstration
from likeme_experiments.evaluation.forecast import DemonstrationCase
from likeme_experiments.imitation import demonstration, episode_log, episodes
from likeme_experiments.imitation.demonstration import (
    background_of,
    new_perception,
    set_up,
    temporary_cell,
)
from likeme_experiments.imitation.episode_log import EpisodeLog, fingerprint
from likeme_experiments.imitation.episodes import EpisodeTask, make_episode, tasks
from likeme_experiments.imitation.imitation_cell import ImitationCell
from likeme_experiments.learning import self_taught_model as learning
from likeme_experiments.learning.robot_identity import simulated_robot
from likeme_experiments.reproductions.models import model_of
from likeme_experiments.reproductions.report import ReproductionOptions
from likeme_inference.tabletop.model_file import format_model, shipped
from likeme_inference.tabletop.robot_model import RobotModel

TEXT = format_model(shipped())
WAYS = ('trajectory', 'goal_based', 'interactive', 'sequential', 'sequential_with_help')
BACK = EpisodeTask(DemonstrationCase('lemon', RIGHT, LEFT, Manner.PUSH), 1)
#: The pear from RIGHT to LEFT is what the paper's robot asks for.
ASKED = EpisodeTask(DemonstrationCase('pear', RIGHT, LEFT, Manner.PLACE), 0)


@pytest.fixture(scope='module')
def lemon_back() -> ImitationEpisode:
    return make_episode(BACK, TEXT, WORLD.source)


def run(*words: str) -> Result:
    return CliRunner().invoke(app, list(words))


def only(name: str) -> RobotModel:
    known = shipped()
    rows = tuple(row for row in known.rows if row.object == name)
    return RobotModel(f'only_{name}', '1', known.sources, rows)


def test_a_result_depends_on_the_actions_alone() -> None:
    push, place = PUSH_RIGHT, PLACE_RIGHT
    with temporary_cell(WORLD, 'lemon') as one, temporary_cell(WORLD, 'lemon') as other:
        wandering = ImitationCell(WORLD, one, 'lemon', LEFT, 7)
        wandering.execute((), place)
        first = wandering.execute((), push)
        wandering.help((), RIGHT)
        straight = ImitationCell(WORLD, other, 'lemon', LEFT, 7)
        assert straight.start == wandering.start
        assert straight.execute((), push) == first
        done = wandering.execute((push,), place)
        assert straight.execute((push,), place) == done
        assert straight.executed == 2
        assert wandering.execute((push,), place) is done
    assert done.view.stamp > first.view.stamp > first.report.finished > 0


def test_all_objects_are_on_the_table_together_and_seen() -> None:
    with temporary_cell(WORLD, 'lemon', together=True) as cell:
        set_up(cell, 'lemon', RIGHT, 7)
        true = cell.true_states()
        assert true['lemon'].state is RIGHT
        assert all(view.state in (LEFT, RIGHT) for view in true.values())
        perception = new_perception(WORLD, cell, background_of(WORLD, 'lemon'))
        perception.wait_until_settled()
        others = perception.others('lemon')
    assert others.keys() == set(WORLD.objects) - {'lemon'}
    for name, view in others.items():
        assert np.hypot(view.x - true[name].x, view.y - true[name].y) < 0.01
        assert min(view.length, view.width, view.height) > 0.03


def test_an_episode_repeats_and_closes_every_cell_it_makes(
    lemon_back: ImitationEpisode, monkeypatch: pytest.MonkeyPatch
) -> None:
    made: list[Cell] = []

    def new_cell(*arguments: Any) -> Cell:
        made.append(Cell(*arguments))
        return made[-1]

    monkeypatch.setattr(demonstration, 'Cell', new_cell)
    assert make_episode(BACK, TEXT, WORLD.source) == lemon_back
    assert made
    assert not any(cell.physics_world.client.isConnected() for cell in made)


def test_an_episode_follows_from_task_and_model(lemon_back: ImitationEpisode) -> None:
    asked = make_episode(ASKED, TEXT, WORLD.source)
    assert asked.understood
    assert lemon_back.perceived == (PerceivedDemonstration(RIGHT, LEFT, Manner.PUSH),)
    for results in asked.results.values():
        assert results[Mode.TRAJECTORY].actions == (PLACE_LEFT,)
        interactive = results[Mode.INTERACTIVE]
        assert (interactive.asked, interactive.actions) == (True, ())
        assert interactive.helped == LEFT
        assert results[Mode.GOAL_BASED].actions == (PUSH_LEFT,)
        assert results[Mode.SEQUENTIAL].states[0] == results[Mode.GOAL_BASED].states[0]
    assert {len(e[Mode.TRAJECTORY].actions) for e in lemon_back.results.values()} == {1}


def test_every_task_has_its_own_seeds() -> None:
    wanted = tasks(WORLD, ('pear', 'lemon', 'chicken'), 2)
    seeds = {task.seed_for(purpose) for task in wanted for purpose in ('shown', 'put back')}
    assert (len(wanted), len(seeds)) == (48, 96)


@pytest.fixture(scope='module')
def lemons(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A model of the lemon alone."""
    path = tmp_path_factory.mktemp('model') / 'lemon.csv'
    path.write_text(format_model(only('lemon')))
    return path


@pytest.mark.slow
def test_a_stopped_table_continues_with_other_workers(
    lemons: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv('LIKEME_ROOT', str(tmp_path))
    monkeypatch.setattr(episodes, 'tasks', lambda *given: tasks(*given)[1::2])
    words = ['table1-executed', '--model', str(lemons), '--seeds', '1', '--json']
    first = run(*words, '--workers', '2', '--out', str(tmp_path / 'drawn'))
    assert first.exit_code == 0, first.output
    (log,) = (tmp_path / 'out' / 'table1-executed').iterdir()
    lines = log.read_text().splitlines(keepends=True)
    assert len(lines) == 4
    # As a power-off leaves it: all lines whole but the last one.
    log.write_text(''.join(lines[:3]) + lines[3][:40])
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
        assert row['paper']['trajectory'] == {'place': 0.525, 'push': 0.575}[row['demonstration']]
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


def test_a_log_is_of_one_model(tmp_path: Path, lemon_back: ImitationEpisode) -> None:
    EpisodeLog(tmp_path, TEXT, WORLD).add(lemon_back)
    assert list(EpisodeLog(tmp_path, TEXT, WORLD).episodes.values()) == [lemon_back]
    assert not EpisodeLog(tmp_path, format_model(only('pear')), WORLD).episodes
    assert fingerprint(TEXT, WORLD) == fingerprint(TEXT, WORLD)


@pytest.mark.parametrize(
    'data', ['likeme_perception/config.py', 'likeme_core/worlds/chung2015.yaml']
)
def test_a_log_is_of_one_version_of_code_and_data(
    data: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before, package = fingerprint(TEXT, WORLD), data.partition('/')[0]
    source = Path(str(files(package)))
    shutil.copytree(source, tmp_path / package)
    monkeypatch.setattr(
        episode_log, 'files', lambda name: tmp_path / name if name == package else files(name)
    )
    assert fingerprint(TEXT, WORLD) == before
    with (tmp_path / data).open('a') as file:
        file.write('\n# changed\n')
    assert fingerprint(TEXT, WORLD) != before


def test_a_self_taught_model_is_learned_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    place = str(tmp_path / 'experience.sqlite')

    def taught() -> RobotModel:
        return learning.self_taught(WORLD, 1, 5, 1, ('lemon',), place)

    model = taught()
    assert model.label == 'self_taught 18'
    assert list(model.sources) == [f'{simulated_robot(WORLD)}/offline-5']
    monkeypatch.setattr(
        learning, 'learn_locally', lambda *_: pytest.fail('All trials are recorded.')
    )
    assert format_model(taught()) == format_model(model)
    stored = model_of(ReproductionOptions(model=place))
    assert stored.rows == model.rows


def test_fig_7_of_another_robot(tmp_path: Path) -> None:
    path = tmp_path / 'model.csv'
    path.write_text(TEXT.replace('chung2015_robot', 'another'))
    answer = run('fig7', '--model', str(path), '--json', '--out', str(tmp_path))
    assert answer.exit_code == 0, answer.output
    document = json.loads(answer.stdout)
    assert document['model'] == 'another 1'
    assert document['beside'] == {'model': shipped().label, 'rows': document['rows']}
    assert (tmp_path / 'fig7.png').exists()
    assert f'in brackets {shipped().label}' in run('fig7', '--model', str(path)).stdout


def test_exploration_names_its_worlds(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
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


def test_a_model_without_objects_of_the_cell(tmp_path: Path) -> None:
    path = tmp_path / 'model.csv'
    path.write_text(format_model(only('pear')).replace('pear', 'turnip'))
    answer = run('table1-executed', '--model', str(path))
    assert answer.exit_code == 1
    assert 'at least one object of the world chung2015 (pear, lemon, chicken)' in answer.stderr
    assert 'got turnip' in answer.stderr

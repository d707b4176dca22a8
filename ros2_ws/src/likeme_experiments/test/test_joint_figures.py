"""The figures of joint goals, and what the failed-attempt experiment shows."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import cv2
import pytest
from typer.testing import CliRunner

from likeme_core.paper_world import WORLD
from likeme_experiments.commands.reproduce import app
from likeme_experiments.evaluation.failed_attempt import TRIES, Agent, Group, failed_attempt
from likeme_inference.tabletop import shipped
from likeme_inference.tabletop.joint_goals import learned_transitions


def run(*words: str) -> Any:
    return CliRunner().invoke(app, list(words))


def test_a_failed_attempt_is_imitated_like_a_success() -> None:
    found = failed_attempt(WORLD, learned_transitions(WORLD, shipped()))
    infers = {group: found.success[group][Agent.INFERS] for group in Group}

    # 3 objects, 2 states of each within reach, 4 actions towards others, 2 places of the rest.
    assert found.cases == 3 * 2 * 4 * 2
    assert infers[Group.ATTEMPT] > 0.85 * infers[Group.TARGET]
    assert infers[Group.ATTEMPT] > found.success[Group.ATTEMPT][Agent.COPIES_ACT]
    assert found.success[Group.ATTEMPT][Agent.COPIES_OUTCOME] == 0
    assert infers[Group.CONTROL] == 0
    assert len(found.belief[Group.ATTEMPT]) == TRIES + 2
    assert found.belief[Group.CONTROL][-1] < found.belief[Group.ATTEMPT][0]


@pytest.mark.parametrize('name', ['joint', 'failed_attempt'])
def test_pictures_and_text(name: str, tmp_path: Path) -> None:
    few = ['--seeds', '2'] * (name == 'joint')
    answer = run(name, '--out', str(tmp_path), *few)

    assert answer.exit_code == 0, answer.output
    assert max(map(len, answer.stdout.splitlines())) <= 80
    picture = cv2.imread(str(tmp_path / f'{name}.png'))
    assert picture is not None
    assert picture.std() > 10


def test_numbers() -> None:
    rows = json.loads(run('failed_attempt', '--json').stdout)['rows']

    assert [row['group'] for row in rows] == ['target', 'attempt', 'control']
    assert rows[1]['success']['copies_outcome'] == 0

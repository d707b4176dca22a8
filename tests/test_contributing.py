"""The recipes of CONTRIBUTING.md, followed step by step."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from likeme_bringup.world_commands import new
from likeme_core.world import load_world
from likeme_core.world.file import world_path
from test_teach import views

ROOT = Path(__file__).parents[1]
TEXT = (ROOT / 'CONTRIBUTING.md').read_text(encoding='utf-8')


def diffs_of(title: str) -> list[str]:
    """The diffs of a recipe, one a file."""
    section = TEXT.partition(f'## {title}\n')[2].partition('\n## ')[0]
    found = re.findall(r'```diff\n(.*?)```', section, re.DOTALL)
    assert found, f'No diff in "{title}".'
    return found


@pytest.fixture
def changed(request: pytest.FixtureRequest, tmp_path: Path) -> dict[str, str]:
    """The environment of a copy of the sources to which a recipe's diff is applied."""
    source = tmp_path / 'ros2_ws' / 'src'
    ignored = shutil.ignore_patterns('__pycache__', '*.egg-info')
    for name in ('likeme_core', 'likeme_inference', 'likeme_experiments'):
        shutil.copytree(ROOT / 'ros2_ws' / 'src' / name, source / name, ignore=ignored)
    outside = os.environ | {'GIT_CEILING_DIRECTORIES': str(tmp_path.parent)}
    for diff in diffs_of(request.param):
        command = ['git', 'apply', '--recount', '-']
        subprocess.run(command, input=diff, text=True, cwd=tmp_path, env=outside, check=True)
    roots = [str(folder) for folder in source.iterdir()]
    return os.environ | {'PYTHONPATH': os.pathsep.join([*roots, os.environ.get('PYTHONPATH', '')])}


def run(code: str, environment: dict[str, str]) -> str:
    command = [sys.executable, '-c', code]
    done = subprocess.run(
        command, capture_output=True, text=True, timeout=120, check=False, env=environment
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


@pytest.mark.parametrize('changed', ['Add an exploration policy'], indirect=True)
def test_add_an_exploration_policy(changed: dict[str, str]) -> None:
    code = """
from itertools import count
import numpy as np
from likeme_core.paper_world import WORLD
from likeme_experiments.learning.campaigns import PolicyName, campaign_of
from likeme_inference.experience.trial import no_counts
policy = campaign_of(WORLD, 'offline', 'robot', 1, ('pear',), PolicyName('sweep'), 1, None).policy
counts, rng, chosen = no_counts(WORLD, ('pear',)), np.random.default_rng(1), 0
while (pair := policy.next(WORLD, counts, rng)) is not None:
    counts[pair.object][pair.x_i, pair.action, 0] += 1
    chosen += 1
print(chosen)
"""
    assert run(code, changed) == '18'


@pytest.mark.parametrize('changed', ['Add a parameter to a node'], indirect=True)
def test_add_a_parameter(changed: dict[str, str]) -> None:
    code = """
from likeme_core.settings import defaults
from likeme_core.paper_world import WORLD
from likeme_inference.node_settings import settings_of
settings = settings_of(WORLD)
print(defaults(settings)['quiet_time'], settings['quiet_time'].limits)
"""
    assert run(code, changed) == '0.0 (0, 60)'


def test_add_an_object(tmp_path: Path) -> None:
    path = tmp_path / 'limes.yaml'
    new(path)
    seen = views('plum', tmp_path / 'views', 5)
    command = [
        sys.executable,
        '-m',
        'likeme_replay.camera_tools.teach',
        'lime',
        seen,
        '--world',
        path,
    ]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    assert load_world(str(path)).objects[-1] == 'lime'


def test_add_a_region_and_an_action(tmp_path: Path) -> None:
    path = tmp_path / 'tray.yaml'
    text = yaml.safe_load(world_path('chung2015').read_text(encoding='utf-8'))
    text['name'] = 'tray'
    text['objects'] = [entry for entry in text['objects'] if 'looks' in entry]
    for entry in text['objects']:
        entry.pop('simulation', None)
    text['regions'].insert(0, {
        'name': 'TRAY',
        'rectangle': {'x': [0.62, 0.66], 'y': [0.0, 0.1]},
        'place': [0.64, 0.05],
    })  # fmt: skip
    text['actions'].append({'name': 'PLACE_TRAY', 'manner': 'place', 'target': 'TRAY'})
    path.write_text(yaml.safe_dump(text), encoding='utf-8')
    world = load_world(str(path))
    assert [int(state) for state in world.states] == [0, 1, 2, 3]
    assert world.action('place_tray').target == world.state('TRAY') == 0

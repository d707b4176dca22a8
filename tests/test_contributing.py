"""The recipes of CONTRIBUTING.md, followed step by step."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import cv2
import pytest
import yaml

from likeme_arm_sim.cell import Cell, CellSettings
from likeme_core.paper_world import RIGHT, WORLD
from likeme_inference.tabletop.model_file import load_tabletop
from likeme_perception.catalogue import load_catalogue
from likeme_perception.config import config_from
from likeme_perception.state_probability import regions_of

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
from likeme_experiments.learning.campaigns import PolicyName, campaign_of
from likeme_inference.experience.trial import no_counts
policy = campaign_of('offline', 'robot', 1, ('pear',), PolicyName('sweep'), 1, None).policy
counts, rng, chosen = no_counts(('pear',)), np.random.default_rng(1), 0
while (pair := policy.next(counts, rng)) is not None:
    counts[pair.object][pair.x_i, pair.action, 0] += 1
    chosen += 1
print(chosen)
"""
    assert run(code, changed) == '18'


@pytest.mark.parametrize('changed', ['Add a parameter to a node'], indirect=True)
def test_add_a_parameter(changed: dict[str, str]) -> None:
    code = """
from likeme_core.settings import defaults
from likeme_inference.node_settings import SETTINGS
print(defaults(SETTINGS)['quiet_time'], SETTINGS['quiet_time'].limits)
"""
    assert run(code, changed) == '0.0 (0, 60)'


def test_add_an_object(tmp_path: Path) -> None:
    images = Cell(WORLD.only('lemon'), 1, CellSettings(initial_states={})).frame()
    colour, depth = tmp_path / 'colour.png', tmp_path / 'depth.png'
    cv2.imwrite(str(colour), images.rgb[:, :, ::-1])
    cv2.imwrite(str(depth), images.depth_mm)
    command = [sys.executable, '-m', 'likeme_perception.look', colour, depth, '--learn', 'lime']
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    catalogue = tmp_path / 'catalogue.yaml'
    entry = yaml.safe_load(done.stdout)
    catalogue.write_text(yaml.safe_dump(entry if 'objects' in entry else {'objects': entry}))
    assert [known.name for known in load_catalogue(catalogue).objects] == ['lime']

    shipped = ROOT / 'ros2_ws/src/likeme_inference/likeme_inference/data/chung2015_robot.csv'
    model = tmp_path / 'model.csv'
    rows = shipped.read_text('utf-8').splitlines(keepends=True)
    limes = [line.replace('lemon', 'lime') for line in rows if line.startswith('lemon')]
    end = next(number for number, line in enumerate(rows) if line.startswith('end'))
    text = ''.join([*rows[:end], *limes[:4], 'end,58,580\n'])
    model.write_text(text, encoding='utf-8')
    known = load_tabletop(model).objects
    assert set(known) == {'pear', 'lemon', 'chicken', 'lime'}
    assert known['lime'].counts.sum() < known['lemon'].counts.sum()


def test_move_a_region() -> None:
    config = config_from({'blue_line_y': 0.1})
    assert config.table is not None
    regions = regions_of(config, config.table)
    assert regions.state_of(0.44, 0.05) == RIGHT

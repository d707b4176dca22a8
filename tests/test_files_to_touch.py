"""How many files an object, a region, an action and a manner need, counted in a copy."""

from __future__ import annotations

import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
CORE = Path('likeme_core', 'likeme_core')
WORLD = CORE / 'worlds' / 'chung2015.yaml'
MESHES = CORE / 'worlds' / 'meshes'
ORANGE = """
- name: orange
  start: LEFT
  looks:
    colour:
    - {weight: 0.436, mean: [56.1, 38.8, 60.6], deviation: [1.7, 1.5, 1.6]}
    - {weight: 0.364, mean: [50.5, 35.2, 55.5], deviation: [1.9, 1.5, 1.7]}
    - {weight: 0.199, mean: [44.8, 30.7, 49.5], deviation: [2.1, 2.6, 2.8]}
    length: 0.0518
    width: 0.04
    height: 0.0517
    area: 0.00198
  simulation:
    parts:
    - {mesh: meshes/orange.ply, colour: [225, 110, 20]}
    mass: 0.06
    friction: 0.6
"""
#: The middle of the table, taken from both halves.
MIDDLE = """\
- name: MIDDLE
  rectangle: {x: [0.27, 0.61], y: [-0.08, 0.08]}
"""


def edit(path: Path, *changes: tuple[str, str]) -> None:
    text = path.read_text(encoding='utf-8')
    for old, new in changes:
        assert text.count(old) == 1, (path, old)
        text = text.replace(old, new)
    path.write_text(text, encoding='utf-8')


def add_an_object(sources: Path) -> None:
    shutil.copy(sources / MESHES / 'lemon_body.ply', sources / MESHES / 'orange.ply')
    path = sources / WORLD
    path.write_text(path.read_text(encoding='utf-8') + ORANGE, encoding='utf-8')


def add_a_region(sources: Path) -> None:
    edit(
        sources / WORLD,
        ('y: [0.0, 0.33]', 'y: [0.08, 0.33]'),
        ('y: [-0.33, 0.0]', 'y: [-0.33, -0.08]'),
        ('- name: OFFTABLE\n', f'{MIDDLE}- name: OFFTABLE\n'),
    )


def add_an_action(sources: Path) -> None:
    line = '- {name: PUSH_OFFTABLE, manner: push, target: OFFTABLE}\n'
    added = '- {name: PLACE_MIDDLE, manner: place, target: MIDDLE}\n'
    edit(sources / WORLD, (line, line + added))


def add_a_manner(sources: Path) -> None:
    """LOB: let fall from higher than DROP does."""
    line = '- {name: PLACE_MIDDLE, manner: place, target: MIDDLE}\n'
    added = '- {name: LOB_MIDDLE, manner: lob, target: MIDDLE}\n'
    edit(sources / WORLD, (line, line + added))
    edit(
        sources / CORE / 'tabletop.py',
        ('    DROP = 2\n', '    DROP = 2\n    LOB = 3\n'),
        (
            '    Manner.DROP: ',
            "    Manner.LOB: Handling(True, 'lobbed', 'lobbing', fall=0.28),\n    Manner.DROP: ",
        ),
    )
    edit(
        sources / 'likeme_msgs' / 'msg' / 'Demonstration.msg',
        ('uint8 DROP=2\n', 'uint8 DROP=2\nuint8 LOB=3\n'),
    )


#: In this order, each on top of those before; the greatest number of files each may touch.
CHANGES: tuple[tuple[Callable[[Path], None], set[str]], ...] = (
    (add_an_object, {'chung2015.yaml', 'orange.ply'}),
    (add_a_region, {'chung2015.yaml'}),
    (add_an_action, {'chung2015.yaml'}),
    (add_a_manner, {'chung2015.yaml', 'tabletop.py', 'Demonstration.msg'}),
)


def digests(folder: Path) -> dict[Path, str]:
    files = (path for path in folder.rglob('*') if path.is_file())
    return {path: hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


@pytest.fixture(scope='module')
def changed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the sources that hold values of a world, with all changes; counts their files."""
    sources = tmp_path_factory.mktemp('src')
    ignored = shutil.ignore_patterns('__pycache__', '*.egg-info', 'build', 'test')
    for name in ('likeme_core', 'likeme_msgs'):
        shutil.copytree(ROOT / 'ros2_ws' / 'src' / name, sources / name, ignore=ignored)
    for change, expected in CHANGES:
        before = digests(sources)
        change(sources)
        after = digests(sources)
        touched = {path.name for path in after if after[path] != before.get(path)}
        assert touched == expected, change.__name__
    return sources


def test_messages_and_enum_agree_on_the_new_manner(changed: Path) -> None:
    """As test_vocabulary.py demands of them."""
    text = (changed / 'likeme_msgs' / 'msg' / 'Demonstration.msg').read_text(encoding='utf-8')
    code = 'from likeme_core.tabletop import Manner; print({m.name: m.value for m in Manner})'
    command = [sys.executable, '-c', code]
    done = subprocess.run(
        command, capture_output=True, text=True, timeout=60, check=True, env=environment(changed)
    )
    constants = {n: int(v) for n, v in re.findall(r'^uint8 ([A-Z]+)=(\d+)', text, re.M)}
    assert done.stdout.strip() == str(constants)


@pytest.mark.slow
def test_the_changed_world_runs_through_every_part(changed: Path) -> None:
    """The new object is lobbed to the new region; no other file of any package is changed."""
    command = [sys.executable, '-m', 'run_changed_world', 'orange', 'LEFT', 'MIDDLE', 'LOB']
    done = subprocess.run(
        command, capture_output=True, text=True, timeout=180, check=False,
        env=environment(changed),
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout.splitlines()[-1])
    assert told['seen'] == ['orange', 'LEFT', 'MIDDLE', 'LOB']
    goal, action, sentence = told['decided']
    assert (goal, action) == ('MIDDLE', 'LOB_MIDDLE')
    assert 'I copy what I saw, LOB_MIDDLE, which works with p = 1.00' in sentence
    assert told['done'][0] == 'COMPLETED'


def environment(sources: Path) -> dict[str, str]:
    """Of a process that finds the changed likeme_core before the installed one."""
    roots = [sources / 'likeme_core', ROOT / 'tests', ROOT / 'benchmarks']
    path = os.pathsep.join([*map(str, roots), os.environ.get('PYTHONPATH', '')])
    return os.environ | {'PYTHONPATH': path}

"""Recordings of the other worlds: one log from the scene, offline and in lockstep."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from domain_coordinator import domain_id

from bag_recipes import LEARNING, SEEN, Recipe, Show, Wait
from likeme_bags.reading import open_bag
from likeme_core.world import load_world
from likeme_replay.decision_log import read_log
from likeme_replay.recorded_inputs import CAMERA_TOPICS
from make_bags import write_bag

pytestmark = [pytest.mark.graph, pytest.mark.slow]


@pytest.mark.parametrize(
    ('name', 'thing', 'start', 'action'),
    [
        ('three_bins', 'cube', 'LEFT', 'PUSH_MIDDLE'),
        ('one_more_manner', 'chicken', 'RIGHT', 'DROP_LEFT'),
    ],
)
def test_one_demonstration_replays_to_one_log(
    tmp_path: Path, name: str, thing: str, start: str, action: str
) -> None:
    world = load_world(name)
    shown = world.action(action)
    deeds = Wait(LEARNING), Show(thing, shown), Wait(SEEN)
    recipe = Recipe('act', 1, {thing: world.state(start)}, deeds, action, name)
    # Raises if the offline replay leads to another log than the scene itself.
    offline = write_bag(tmp_path / 'act', recipe)
    names = {topic.name for topic in open_bag(tmp_path / 'act').topics}
    assert names == {f'/{name}' for name in CAMERA_TOPICS}
    act, belief, at_goal = read_log(offline)
    assert (act['object'], act['x_f'], act['manner']) == (thing, shown.target, shown.manner)
    assert belief['goal'] == at_goal['goal'] == shown.target

    log = tmp_path / 'lockstep.jsonl'
    with domain_id() as domain:
        command = [sys.executable, '-m', 'likeme_replay.replay', str(tmp_path / 'act')]
        done = subprocess.run(
            [*command, '--log', str(log)], capture_output=True, text=True, timeout=200,
            env=os.environ | {'ROS_DOMAIN_ID': str(domain)}, check=False,
        )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert log.read_text(encoding='utf-8') == offline

"""Live learning while nodes are killed: no trial is lost or doubled."""

from __future__ import annotations

import signal
import sys
from contextlib import closing
from pathlib import Path

import psutil
import pytest
from domain_coordinator import domain_id

from graph import Graph, NodeProcess
from in_process import command
from likeme_core.paper_world import WORLD
from likeme_experiments.commands import learn
from likeme_experiments.learning.campaigns import PolicyName, campaign_of
from likeme_experiments.ros import live_learning
from likeme_inference.experience.store import ExperienceStore

pytestmark = pytest.mark.graph
START_CELL = (sys.executable, '-m', 'likeme_bringup.start_cell')
LEARN = (sys.executable, '-m', 'likeme_experiments.commands.learn')
WORDS = ('--object', 'chicken', '--policy', 'random', '--trials', '4', '--robot', 'test')
CAMPAIGN = campaign_of(WORLD, 'live', 'test', 1, ('chicken',), PolicyName.RANDOM, 10, 4)
#: s at most for one trial, with a restart of the cell in it.
A_TRIAL = 60.0


def kill_nodes_of(process: NodeProcess) -> None:
    """Kill -9 the node under a start_cell, which ends then."""
    for child in psutil.Process(process.pid).children(recursive=True):
        child.kill()
    assert process.wait(15) == 1


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_kills_of_arm_perception_and_learner(tmp_path: Path) -> None:
    with (
        Graph(tmp_path) as graph,
        closing(ExperienceStore(str(tmp_path / 'x.sqlite'), WORLD)) as store,
    ):

        def start(part: str) -> NodeProcess:
            fast = ('--real-time-factor', '0') if part == 'arm' else ()
            return graph.run(part, *START_CELL, '--no-respawn', '--only', part, *fast)

        def learner_process() -> NodeProcess:
            return graph.run('learn', *LEARN, *WORDS, '--store', store.place)

        def recorded(count: int) -> frozenset[str]:
            graph.until(lambda: len(ids()) >= count, A_TRIAL, f'{count} trials')
            return ids()

        def ids() -> frozenset[str]:
            return store.identities('test', 'live-1')

        parts = {part: start(part) for part in ('hold', 'arm', 'perception')}
        learner, known = learner_process(), frozenset[str]()
        for count, victim in enumerate(('arm', 'learner', 'perception'), start=1):
            now = recorded(count)
            assert known <= now
            known = now
            # Somewhere in the next trial.
            graph.during(1.0)
            if victim == 'learner':
                learner.signal(signal.SIGKILL)
                learner.wait(10)
                learner = learner_process()
            else:
                kill_nodes_of(parts[victim])
                parts[victim] = start(victim)
        assert learner.wait(4 * A_TRIAL) == 0, learner.said
        assert known <= ids()
        assert sorted(ids()) == sorted(key.identity for key in CAMPAIGN.plan())
        assert 'Traceback' not in learner.said


def test_a_missing_cell_is_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(live_learning, 'FIRST_TIMEOUT', 0.5)
    with domain_id() as domain:
        store = str(tmp_path / 'x.sqlite')
        answer = command(learn.run, domain, *WORDS, '--store', store)
    assert answer.code == 3
    assert f'No cell is running on ROS domain {domain}: start one with' in answer.stderr

"""Learning with people's resets in the simulated cell, with its person, and a killed learner."""

from __future__ import annotations

import os
import subprocess
import sys
from contextlib import closing
from pathlib import Path

import pytest
from domain_coordinator import domain_id

from graph import Graph
from in_process import command
from likeme_core.paper_world import PLACE_RIGHT, RIGHT, WORLD
from likeme_core.processes import die_with_parent
from likeme_experiments.commands import learn
from likeme_experiments.learning.reset_prompt import MENU
from likeme_inference.experience.store import ExperienceStore
from likeme_inference.experience.trial import Pair
from likeme_msgs.srv import ExecuteAction, ResetCell

pytestmark = pytest.mark.graph
START_CELL = (sys.executable, '-m', 'likeme_bringup.start_cell', '--no-respawn')
PARTS = ('--only', 'hold', '--only', 'arm', '--only', 'perception', '--real-time-factor', '0')
LEARN = (sys.executable, '-m', 'likeme_experiments.commands.learn', '--resets', 'human')
#: One trial by this seed, of PAIR.
WORDS = ('--object', 'chicken', '--policy', 'random', '--trials', '1', '--seed', '9')
PAIR = Pair('chicken', RIGHT, PLACE_RIGHT)
REQUEST = 'Please put the chicken RIGHT, with room around it.'


class Terminal:
    """A learner whose answers this test types."""

    def __init__(self, graph: Graph, store: Path, log: Path) -> None:
        command = [*LEARN, *WORDS, '--robot', 'test', '--store', str(store)]
        self._log = log
        with log.open('wb') as out:
            self.process = subprocess.Popen(
                command, stdin=subprocess.PIPE, stdout=out, stderr=subprocess.STDOUT,
                env=graph.env, preexec_fn=die_with_parent(os.getpid()),
            )  # fmt: skip

    @property
    def said(self) -> str:
        """All it printed so far."""
        return self._log.read_text(encoding='utf-8')

    def type(self, line: str) -> None:
        """Type a line."""
        assert self.process.stdin is not None
        self.process.stdin.write(f'{line}\n'.encode())
        self.process.stdin.flush()

    def asks_or_ended(self, graph: Graph, answered: int) -> bool:
        """Wait for a request after those answered, True, or for the end, False."""
        graph.until(
            lambda: self.said.count(MENU) > answered or self.process.poll() is not None,
            40, 'a request, or the end',
        )  # fmt: skip
        return self.said.count(MENU) > answered

    def end(self) -> None:
        """End it, if it runs."""
        self.process.kill()
        self.process.wait()
        if self.process.stdin is not None:
            self.process.stdin.close()


@pytest.mark.slow
def test_a_person_is_asked_and_a_killed_learner_asks_again(tmp_path: Path) -> None:
    place = tmp_path / 'x.sqlite'
    with Graph(tmp_path) as graph:
        graph.run('cell', *START_CELL, *PARTS)
        states = ['offtable'] * len(WORLD.objects)
        away = ResetCell.Request(objects=list(WORLD.objects), states=states)
        assert graph.call(ResetCell, 'cell/reset', away, 40, again=5).success
        learner = Terminal(graph, place, tmp_path / 'first.log')
        try:
            assert learner.asks_or_ended(graph, 0), learner.said
            learner.end()
            learner = Terminal(graph, place, tmp_path / 'second.log')
            answered = 0
            while learner.asks_or_ended(graph, answered):
                assert REQUEST in learner.said
                request = ExecuteAction.Request(object='chicken', action='place_right')
                assert graph.call(ExecuteAction, 'human/execute_action', request, 60).success
                learner.type('done')
                answered += 1
            assert learner.process.wait() == 0, learner.said
            assert f'in {answered} requests' in learner.said
        finally:
            learner.end()
    with closing(ExperienceStore(str(place), WORLD)) as store:
        made = [trial.key.pair for trial in store.trials('test', 'human-9')]
    assert PAIR in made


@pytest.mark.parametrize(
    ('words', 'said'),
    [
        (('--offline',), 'is for the live cell, not for --offline.'),
        ((), 'Expected --robot NAME with --resets human'),
        (('--robot', 'arm', '--policy', 'information-gain'), 'plans ahead; information-gain'),
    ],
)
def test_options_that_do_not_go_together(words: tuple[str, ...], said: str) -> None:
    with domain_id() as domain:
        answer = command(learn.run, domain, '--resets', 'human', *words)
    assert answer.code == 2
    assert said in answer.stderr

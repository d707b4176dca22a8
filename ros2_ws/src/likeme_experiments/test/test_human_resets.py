"""Learning on a table that people set up, against a fake cell and a scripted person."""

from __future__ import annotations

import io
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from itertools import count
from pathlib import Path

import pytest
from domain_coordinator import domain_id
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rich.console import Console

from likeme_core.outcomes import MotionOutcome
from likeme_core.paper_world import LEFT, OFFTABLE, PLACE_LEFT, RIGHT, WORLD
from likeme_core.ros.heartbeat import HEARTBEAT_QOS
from likeme_core.ros.time import time_msg
from likeme_core.tabletop import State
from likeme_experiments.learning.reset_prompt import ResetAnswer
from likeme_experiments.learning.trial_reporter import TrialReporter
from likeme_experiments.ros.human_reset_learning import HumanResetLearner, stayed
from likeme_experiments.ros.table_explorer_node import ImitationActiveError, TableExplorerNode
from likeme_inference.experience.campaign import Campaign, Progress
from likeme_inference.experience.exploration_policy import Systematic
from likeme_inference.experience.reset_planning import Reset
from likeme_inference.experience.store import ExperienceStore
from likeme_inference.experience.trial import Pair, Place, Trial
from likeme_msgs.msg import Heartbeat, ObjectState, TableState
from likeme_msgs.srv import ExecuteAction

NAMES = 'pear', 'lemon'
FRAME = 500_000_000
CAMPAIGN = Campaign(WORLD, 'test', 'human-1', 1, NAMES, Systematic(1))


class FakeTable(Node):
    """Objects that every action brings to its target; the arm refuses those off the table.

    Attributes:
        states: of the objects; UNKNOWN by ObjectState's number.
        unseen: objects that the camera never saw.
        in_the_way: pairs that are refused with NOT_FREE.
        acted: pairs that the arm was asked for.
    """

    def __init__(self, context: Context) -> None:
        super().__init__('fake_table', context=context, start_parameter_services=False)
        self.states: dict[str, int] = dict.fromkeys(NAMES, OFFTABLE)
        self.unseen: set[str] = set()
        self.in_the_way: set[Pair] = set()
        self.acted: list[Pair] = []
        self._stamps = count(FRAME, FRAME)
        self._table = self.create_publisher(TableState, 'table_state', 1)
        self.create_timer(0.01, self._publish)
        self.create_service(ExecuteAction, 'arm/execute_action', self._act)

    def _publish(self) -> None:
        message = TableState(settled=True)
        message.header.stamp = time_msg(next(self._stamps))
        message.objects = [
            ObjectState(name=name, state=int(state), last_seen=time_msg(name not in self.unseen))
            for name, state in self.states.items()
        ]
        self._table.publish(message)

    def _act(
        self, request: ExecuteAction.Request, response: ExecuteAction.Response
    ) -> ExecuteAction.Response:
        state, action = self.states[request.object], WORLD.action(request.action)
        pair = Pair(request.object, WORLD.states[state], action)
        self.acted.append(pair)
        outcome = MotionOutcome.COMPLETED
        if pair in self.in_the_way:
            outcome = MotionOutcome.NOT_FREE
        elif state == OFFTABLE:
            outcome = MotionOutcome.OBJECT_OFFTABLE
        else:
            self.states[request.object] = action.target
        response.success = outcome is MotionOutcome.COMPLETED
        response.outcome, response.message = int(outcome), f'{outcome.name}.'
        response.started, response.finished = (time_msg(next(self._stamps)) for _ in range(2))
        return response


class Person:
    """Answers as it is told, and does what it is asked where it is told nothing.

    Attributes:
        requests: what it was asked for; reasons: that were told with it.
    """

    def __init__(self, table: FakeTable) -> None:
        self._table = table
        self.script: list[Callable[[Sequence[Reset]], ResetAnswer]] = []
        self.requests: list[tuple[Reset, ...]] = []
        self.reasons: list[str] = []

    def ask(self, resets: Sequence[Reset], reasons: Sequence[str] = ()) -> ResetAnswer:
        """See ResetPrompt."""
        self.requests.append(tuple(resets))
        self.reasons += reasons
        return (self.script.pop(0) if self.script else self.obey)(resets)

    def obey(self, resets: Sequence[Reset]) -> ResetAnswer:
        """Do it, with room around."""
        for name, state in resets:
            self._table.states[name] = state
        self._table.in_the_way.clear()
        self._table.unseen.clear()
        return ResetAnswer.DONE


@pytest.fixture
def table_and_explorer() -> Iterator[tuple[FakeTable, TableExplorerNode]]:
    with domain_id() as domain:
        context = Context()
        context.init(domain_id=domain)
        table, explorer = FakeTable(context), TableExplorerNode(WORLD, context)
        executor = SingleThreadedExecutor(context=context)
        executor.add_node(table)
        thread = threading.Thread(target=executor.spin)
        thread.start()
        try:
            explorer.wait_for_cell(30.0)
            yield table, explorer
        finally:
            explorer.close()
            executor.shutdown()
            thread.join(10)
            table.destroy_node()
            context.try_shutdown()


@pytest.fixture
def store(tmp_path: Path) -> Iterator[ExperienceStore]:
    with closing(ExperienceStore(str(tmp_path / 'x.sqlite'), WORLD)) as opened:
        yield opened


def learner_of(
    explorer: TableExplorerNode, person: Person, progress: Progress
) -> tuple[HumanResetLearner, io.StringIO]:
    """A learner, and what it prints."""
    said = io.StringIO()
    reporter = TrialReporter(progress, Console(file=said, width=300))
    return HumanResetLearner(explorer, reporter, '0', None, person), said


def test_a_campaign_asks_for_what_the_robot_cannot_do(
    table_and_explorer: tuple[FakeTable, TableExplorerNode], store: ExperienceStore
) -> None:
    table, explorer = table_and_explorer
    person, progress = Person(table), Progress(CAMPAIGN, store)

    def elsewhere(resets: Sequence[Reset]) -> ResetAnswer:
        """The first object is put where nobody asked for it, the second stays."""
        table.states[resets[0].object] = LEFT if resets[0].state == RIGHT else RIGHT
        return ResetAnswer.DONE

    person.script = [elsewhere]
    learner, said = learner_of(explorer, person, progress)
    learner.learn(progress, store)
    assert progress.done == progress.total == 36
    assert learner.left(progress) == ''
    # Trials from OFFTABLE needed nobody.
    assert {pair.x_i for pair in table.acted[:12]} == {OFFTABLE}
    assert {reset.object for reset in person.requests[0]} == set(NAMES)
    assert 'The camera sees the lemon OFFTABLE, not' in said.getvalue()
    # Four trials of each object end off the table; it began there, and may stay there at the end.
    assert sum(learner.asked) == 8
    assert len(person.requests) < 8
    assert learner.recorded == 36 + learner.transports
    assert 'People made 8 resets' in learner.summary()
    # Nothing of it is tried again after a restart.
    again, _ = learner_of(explorer, person, Progress(CAMPAIGN, store))
    again.learn(Progress(CAMPAIGN, store), store)
    assert again.recorded == 0


def test_skipped_resets_are_left_and_the_rest_is_done(
    table_and_explorer: tuple[FakeTable, TableExplorerNode], store: ExperienceStore
) -> None:
    table, explorer = table_and_explorer
    person, progress = Person(table), Progress(CAMPAIGN, store)
    person.script = [lambda _: ResetAnswer.SKIP] * 20
    learner, _ = learner_of(explorer, person, progress)
    learner.learn(progress, store)
    assert progress.done == 12
    # Each object once LEFT and once RIGHT.
    assert len(person.requests) == 2
    assert learner.left(progress).startswith(
        '24 trials are left, as their resets were skipped: pear from LEFT (6), pear from RIGHT (6)'
    )
    # The same command asks again.
    person.script = []
    again, _ = learner_of(explorer, person, Progress(CAMPAIGN, store))
    again.learn(progress, store)
    assert progress.done == 36


def test_what_was_never_seen_and_refused_motions_are_no_trials(
    table_and_explorer: tuple[FakeTable, TableExplorerNode], store: ExperienceStore
) -> None:
    table, explorer = table_and_explorer
    person, progress = Person(table), Progress(CAMPAIGN, store)
    table.states = {'pear': OFFTABLE, 'lemon': LEFT}
    table.unseen = {'pear'}
    table.in_the_way = {Pair('lemon', LEFT, action) for action in WORLD.actions}
    learner, _ = learner_of(explorer, person, progress)
    learner.learn(progress, store)
    assert progress.done == 36
    # The arm was not asked for the pear, which was never seen, before a person put it down.
    assert {pair.object for pair in table.acted[:6]} == {'lemon'}
    # It is put there anew, where it is already, with room around it.
    assert person.requests[0][1] == Reset('lemon', LEFT)
    assert [reset.object for reset in person.requests[0]] == ['pear', 'lemon']
    assert person.reasons == ['The arm did not try: NOT_FREE.'] * len(WORLD.actions)


@pytest.mark.parametrize(
    ('x_f', 'y', 'expected'),
    [(LEFT, 0.11, True), (LEFT, 0.13, False), (RIGHT, 0.11, False), (LEFT, None, False)],
)
def test_an_object_that_moved_is_a_new_chance(x_f: State, y: float | None, expected: bool) -> None:
    key = CAMPAIGN.key(Pair('pear', LEFT, PLACE_LEFT), 0)
    before, after = Place(0.4, 0.1, 0.0), None if y is None else Place(0.4, y, 1.0)
    trial = Trial(key, x_f, MotionOutcome.NOT_GRASPED, 0, '0', 0, before, after)
    assert stayed(trial) is expected


def test_an_active_inference_node_is_refused(
    table_and_explorer: tuple[FakeTable, TableExplorerNode], store: ExperienceStore
) -> None:
    table, explorer = table_and_explorer
    beats = table.create_publisher(Heartbeat, 'heartbeat', HEARTBEAT_QOS)
    beat = Heartbeat(node='/inference_node', run='1', state=Heartbeat.READY)
    table.create_timer(0.02, lambda: beats.publish(beat))
    explorer.wait_for(lambda: explorer.count_publishers('heartbeat') > 0)
    progress = Progress(CAMPAIGN, store)
    learner, _ = learner_of(explorer, Person(table), progress)
    with pytest.raises(ImitationActiveError, match='start the cell with --only hold'):
        learner.learn(progress, store)

"""The services of a whole cell, over real processes: refusals, hold in mid-motion, ask_human."""

from __future__ import annotations

import math
import signal
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger

from graph import HOLD_KEEPER, LATCHED, Graph
from likeme_core.paper_world import LEFT, OFFTABLE, RIGHT, WORLD
from likeme_core.ros.time import stamp_ns, time_msg
from likeme_core.tabletop import State
from likeme_msgs.msg import Decision, Outcome, TableState
from likeme_msgs.srv import AskHuman, ExecuteAction, ResetCell

pytestmark = pytest.mark.graph
SCRIPTS = Path(__file__).parents[1] / 'scripts'
Act, Ask = ExecuteAction.Request, AskHuman.Request
#: s of real time in which a held motion must have been answered.
HELD_WITHIN = 1.0
#: rad by which a joint that stands still may seem to move.
STILL = 2e-3


class LiveCell:
    """The three nodes, the arm first, and a caller of their services."""

    def __init__(self, graph: Graph) -> None:
        self.graph = graph
        graph.start(HOLD_KEEPER)
        self.arm = graph.start('likeme_arm_sim.arm_driver_node', seed=1)
        self.tables = graph.collect(TableState, 'table_state')
        self.joints = graph.collect(JointState, 'joint_states')
        self.clocks = graph.collect(Clock, '/clock')
        self.decisions = graph.collect(Decision, 'decision', LATCHED)
        self.outcomes = graph.collect(Outcome, 'outcome', LATCHED)

    def begin(self, who: str, name: str, action: str, **fields: Any) -> Any:
        """Ask arm or human to act; the future of the answer."""
        request = Act(object=name, action=action, **fields)
        return self.graph.send(ExecuteAction, f'{who}/execute_action', request)

    def act(self, who: str, name: str, action: str, **fields: Any) -> ExecuteAction.Response:
        """Have arm or human act; the answer."""
        return self.end(self.begin(who, name, action, **fields), 60)

    def end(self, future: Any, seconds: float) -> Any:
        """Wait for an answer."""
        self.graph.until(future.done, seconds, 'an answer')
        return future.result()

    def trigger(self, name: str) -> Trigger.Response:
        """Hold or resume."""
        return self.graph.call(Trigger, f'cell/{name}', Trigger.Request())

    def reset(self, **places: State) -> ResetCell.Response:
        """Set objects in states."""
        request = ResetCell.Request(
            objects=list(places), states=[state.name for state in places.values()], seed=5
        )
        return self.graph.call(ResetCell, 'cell/reset', request)

    def ask(self, **fields: Any) -> AskHuman.Response:
        """Call ask_human."""
        return self.graph.call(AskHuman, 'ask_human', Ask(**fields))

    def now(self) -> int:
        """Give the simulated time, ns."""
        self.graph.until(lambda: self.clocks, 20, 'a clock')
        return stamp_ns(self.clocks[-1].clock)

    def see(self, **states: int) -> None:
        """Wait until the camera sees objects at rest in states."""

        def seen() -> bool:
            if not self.tables or not self.tables[-1].settled:
                return False
            there = {o.name: o.state for o in self.tables[-1].objects}
            return all(there[name] == state for name, state in states.items())

        self.tables.clear()
        self.graph.until(seen, 20, f'the camera to see {states}')

    def until_in_mid_motion(self, motion: Any, seconds: float) -> None:
        """Let a motion go on for a while of simulated time."""
        begin = self.now()
        self.graph.until(lambda: self.now() > begin + seconds * 1e9, 30, 'some motion')
        assert not motion.done()

    def joints_move(self, seconds: float) -> float:
        """How far a joint goes from where it is, rad, while simulated time passes."""
        self.joints.clear()
        begin = self.now()
        self.graph.until(lambda: self.now() > begin + seconds * 1e9, 30, 'time to pass')
        first = self.joints[0].position
        return max(math.dist(first, message.position) for message in self.joints)


@pytest.fixture(scope='module')
def arm_alone(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LiveCell]:
    with Graph(tmp_path_factory.mktemp('services')) as graph:
        yield LiveCell(graph)


@pytest.fixture(scope='module')
def cell(arm_alone: LiveCell) -> LiveCell:
    graph = arm_alone.graph
    graph.start('likeme_perception.perception_node')
    graph.start('likeme_inference.inference_node')
    graph.until(lambda: arm_alone.tables, 30, 'a table state')
    return arm_alone


def test_the_arm_before_perception_ever_spoke(arm_alone: LiveCell) -> None:
    answer = arm_alone.act('arm', 'pear', 'push_left')
    assert (answer.success, answer.outcome) == (False, Act.OBJECT_NOT_SEEN)
    assert 'pear' in answer.message
    assert stamp_ns(answer.started) == stamp_ns(answer.finished) == 0


@pytest.mark.parametrize('who', ['arm', 'human'])
def test_nonsense_is_refused_with_a_sentence(cell: LiveCell, who: str) -> None:
    unknown = cell.act(who, 'banana', 'push_left')
    nobody = cell.act(who, '', 'push_left')
    sixth, last = cell.act(who, 'pear', '6'), cell.act(who, 'pear', '')
    other = cell.act(who, 'pear', 'push_left', world='kitchen@0')
    past = time_msg(cell.now() - 2_000_000_000)
    late = cell.act(who, 'pear', 'push_left', expires=past)
    assert [a.outcome for a in (unknown, nobody, sixth, last, late)] == [
        Act.UNKNOWN_OBJECT, Act.UNKNOWN_OBJECT, Act.UNKNOWN_ACTION,
        Act.UNKNOWN_ACTION, Act.EXPIRED,
    ]  # fmt: skip
    assert "got 'banana'" in unknown.message
    assert "push_offtable), got ''" in last.message
    assert (other.outcome, other.success) == (Act.OTHER_WORLD, False)
    assert f'Expected the world {WORLD.label}, got kitchen@0.' == other.message
    assert 'expired' in late.message
    assert not any(a.success for a in (unknown, nobody, sixth, last, late))
    assert cell.joints_move(0.3) < STILL


def test_resets_that_make_no_sense(cell: LiveCell) -> None:
    call = cell.graph.call
    wrong = [
        ResetCell.Request(objects=['banana'], states=['left']),
        ResetCell.Request(objects=['pear'], states=['up']),
        ResetCell.Request(objects=['pear', 'lemon'], states=['left']),
        ResetCell.Request(states=['left']),
        ResetCell.Request(objects=['pear', 'pear'], states=['left', 'right']),
    ]
    answers = [call(ResetCell, 'cell/reset', request) for request in wrong]
    assert not any(answer.success for answer in answers)
    assert all(answer.message.startswith('Expected ') for answer in answers)
    assert "got 'banana'" in answers[0].message


def test_a_hold_in_the_middle_of_a_persons_act(cell: LiveCell) -> None:
    motion = cell.begin('human', 'chicken', 'place_left')
    cell.until_in_mid_motion(motion, 1.0)
    busy, reset = cell.act('human', 'pear', 'push_left'), cell.reset(pear=LEFT)
    robot = cell.begin('arm', 'pear', 'push_left')
    assert busy.outcome == Act.BUSY
    assert not reset.success
    assert 'motion' in reset.message
    begin = time.monotonic()
    assert cell.trigger('hold').success
    held = cell.end(motion, HELD_WITHIN)
    assert time.monotonic() - begin < HELD_WITHIN
    assert (held.success, held.outcome) == (False, Act.HELD)
    assert stamp_ns(held.finished) > stamp_ns(held.started) > 0
    # The robot had waited for the person; a hold does not let it begin.
    assert cell.end(robot, HELD_WITHIN).outcome == Act.HELD
    assert cell.act('human', 'pear', 'push_left').outcome == Act.HELD
    assert cell.trigger('hold').success
    assert cell.trigger('resume').success
    assert cell.act('human', 'chicken', 'place_left').outcome == Act.COMPLETED
    cell.see(chicken=LEFT)


def test_a_hold_in_the_middle_of_the_robots_act(cell: LiveCell) -> None:
    alone = {'chicken': RIGHT, 'pear': OFFTABLE, 'lemon': OFFTABLE}
    assert cell.reset(**alone).success
    cell.see(**alone)
    motion = cell.begin('arm', 'chicken', 'push_left')
    cell.until_in_mid_motion(motion, 1.0)
    assert cell.joints_move(0.2) > STILL
    assert cell.trigger('hold').success
    held = cell.end(motion, HELD_WITHIN)
    assert held.outcome == Act.HELD
    cell.joints_move(0.2)
    assert cell.joints_move(0.5) < STILL
    refused = cell.act('arm', 'chicken', 'push_left')
    assert refused.outcome == Act.HELD
    assert 'resume' in refused.message
    assert cell.joints_move(0.3) < STILL
    assert cell.trigger('resume').success
    cell.see(chicken=RIGHT)
    assert cell.act('arm', 'chicken', 'push_left').outcome == Act.COMPLETED
    assert cell.trigger('resume').message == 'Nothing was held.'


def test_the_arm_cannot_pick_up_what_is_off_the_table(cell: LiveCell) -> None:
    assert cell.reset(lemon=OFFTABLE).success
    cell.see(lemon=OFFTABLE)
    answers = [cell.act('arm', 'lemon', action) for action in ('place_left', 'push_left')]
    assert [a.outcome for a in answers] == [Act.OBJECT_OFFTABLE] * 2
    assert cell.joints_move(0.3) < STILL


@pytest.mark.parametrize(
    ('node', 'name', 'value', 'why'),
    [
        ('arm_driver', 'real_time_factor', -1.0, 'real_time_factor'),
        ('arm_driver', 'camera_rate', 20.0, 'camera_rate'),
        ('perception_node', 'min_height', 5.0, 'min_height'),
        ('inference_node', 'help_threshold', 1.5, 'help_threshold'),
        ('inference_node', 'help_threshold', math.nan, 'help_threshold'),
        ('inference_node', 'mode', 'telepathy', "got 'telepathy'"),
    ],
)
def test_parameters_out_of_range_are_refused_when_set(
    cell: LiveCell, node: str, name: str, value: Any, why: str
) -> None:
    wanted = SetParameters.Request(parameters=[Parameter(name, value=value).to_parameter_msg()])
    result = cell.graph.call(SetParameters, f'{node}/set_parameters', wanted).results[0]
    assert not result.successful
    assert why in result.reason
    assert '\n' not in result.reason


def be_asked(cell: LiveCell) -> int:
    """Have the person show pear RIGHT to LEFT and put it back: the number of the question."""
    assert cell.reset(pear=RIGHT).success
    cell.see(pear=RIGHT)
    cell.decisions.clear()
    assert cell.act('human', 'pear', 'place_left').success
    kinds = cell.decisions
    cell.graph.until(lambda: kinds and kinds[-1].kind == Decision.AT_GOAL, 20, 'AT_GOAL')
    assert cell.act('human', 'pear', 'place_right').success
    cell.graph.until(lambda: kinds[-1].kind == Decision.ASK_HUMAN, 20, 'a question')
    return int(kinds[-1].id)


def operators(cell: LiveCell, *calls: tuple[str, ...]) -> list[tuple[int, str, str]]:
    """Run scripts/ask_human.sh from another folder, once for each call, all at the same time.

    All that comes by the keyboard is a word that is no answer.
    """
    runs = [
        subprocess.Popen(
            [SCRIPTS / 'ask_human.sh', *words],
            env=cell.graph.env,
            cwd='/',
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        for words in calls
    ]
    said = [run.communicate('what?\n', timeout=120) for run in runs]
    for text in (text for texts in said for text in texts):
        if 'Traceback' in text:
            pytest.fail(text)
    return [(run.returncode, *texts) for run, texts in zip(runs, said, strict=True)]


def test_a_question_is_answered_once_by_service_or_script(cell: LiveCell) -> None:
    nothing = cell.ask(command=Ask.LIST)
    early = cell.ask(command=Ask.ANSWER, request_id=1, answer=Ask.SKIP, answered_by='Ada')
    (empty,) = operators(cell, ('list',))
    number = be_asked(cell)
    listed = cell.ask(command=Ask.LIST)
    good = {
        'command': Ask.ANSWER, 'request_id': number, 'answer': Ask.SKIP, 'answered_by': 'Ada',
        'object': 'pear', 'action': 'push_left', 'stamp': listed.pending[0].header.stamp,
    }  # fmt: skip
    refused = [
        cell.ask(**good | wrong)
        for wrong in (
            {'request_id': number + 7}, {'answer': 9}, {'answered_by': '  '},
            {'object': 'chicken'}, {'action': ''}, {'stamp': time_msg(1)}, {'command': 5},
        )
    ]  # fmt: skip
    told, unknown, nonsense, nobody, gone = operators(
        cell,
        ('list',),
        ('answer', '999', 'skip'),
        ('answer', str(number), 'maybe'),
        ('answer', str(number), 'skip', '--by', ' '),
        (),
    )
    (answered,) = operators(cell, ('answer', str(number), 'skip', '--by', 'Ada'))
    # As a client that got no response, and as another operator.
    same, second = cell.ask(**good), cell.ask(**good | {'answered_by': 'Bob'})
    late = cell.ask(**good | {'request_id': number + 1})
    (again,) = operators(cell, ('answer', str(number), 'done'))
    cell.graph.until(lambda: cell.outcomes, 10, 'an outcome')

    assert (nothing.success, nothing.pending) == (True, [])
    assert not early.success
    assert 'Nothing is pending' in early.message
    assert empty[:2] == (0, 'Nothing is pending.\n')
    assert [request.id for request in listed.pending] == [number]
    assert 'pear' in listed.pending[0].question
    assert not any(answer.success for answer in refused)
    assert [request.id for request in refused[-1].pending] == [number]
    why = (
        'pending requests', 'got 9', 'name', 'got one to chicken, push_left',
        'got one to pear, no action', 'of 0.000 s', 'got 5',
    )  # fmt: skip
    for answer, words in zip(refused, why, strict=True):
        assert words in answer.message
    assert f'Request {number}: ' in told[1]
    assert (told[0], told[2]) == (0, '')
    assert [code for code, *_ in (unknown, nonsense, nobody, gone, again)] == [1, 2, 1, 1, 1]
    assert [said.count('\n') for _, _, said in (unknown, nobody, again)] == [1, 1, 1]
    # Its word came before the question was shown, or after.
    said = 'typed before this question is not', 'Expected one of done, try, skip'
    assert any(words in gone[1] for words in said)
    assert f'request {number} stays unanswered' in gone[1] + gone[2]
    assert answered[1] == (
        f'Request {number}, pear: skipped, push_left is not tried (answered by Ada).\n'
    )
    assert (same.success, f'{same.message}\n') == (True, answered[1])
    assert (second.success, late.success) == (False, False)
    assert 'answered already: SKIP by Ada' in second.message
    assert 'Nothing is pending' in late.message
    assert cell.outcomes[-1].result == Outcome.SKIPPED


def test_the_operator_at_the_keyboard(cell: LiveCell) -> None:
    console = subprocess.Popen(
        [SCRIPTS / 'ask_human.sh', '--by', 'Ada'],
        env=cell.graph.env,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    assert console.stdin is not None
    assert console.stdout is not None
    try:
        number = be_asked(cell)
        said = ''
        for typed, end in (('3\n', '> '), ('', '(answered by Ada).\n')):
            while not said.endswith(end):
                character = console.stdout.read(1)
                assert character, said
                said += character
            console.stdin.write(typed)
            console.stdin.flush()
        assert f'Request {number}, pear: skipped' in said
        console.send_signal(signal.SIGINT)
        said += console.communicate(timeout=60)[0]
    finally:
        console.kill()
    assert console.returncode == 0
    assert said.endswith('Bye.\n')

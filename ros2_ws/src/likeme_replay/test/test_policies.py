"""Every policy holds on a good trace, and is the only one that fires on a planted fault."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import policy_cases
import pytest
from policy_traces import BY_NOBODY, UNSURE, Trace, plain, stamp
from typer.testing import CliRunner

from likeme_bags.reading import open_bag
from likeme_bags.typestores import typestore_of
from likeme_bags.values import Record, Topic
from likeme_bags.writing import BagWriter
from likeme_replay.message_definitions import definitions
from likeme_replay.policies.bag_check import check_bag
from likeme_replay.policies.catalogue import POLICIES, table
from likeme_replay.policies.console import app
from likeme_replay.policies.monitor import KEPT, PolicyMonitor
from likeme_replay.policies.policy import TOPICS, Policy
from likeme_replay.policies.seen import Recent


@pytest.mark.parametrize('policy', POLICIES, ids=lambda policy: policy.name())
def test_a_policy_fires_on_its_fault_alone(policy: type[Policy]) -> None:
    case = getattr(policy_cases, policy.name())
    good, bad = Trace(), Trace()
    case(good, bad=False)
    case(bad, bad=True)
    assert not good.monitor.violations
    assert bad.broken == {policy.name()}, bad.monitor.violations


def test_there_are_forty_policies_with_names_of_their_own() -> None:
    assert len({policy.name() for policy in POLICIES}) == len(POLICIES) >= 40
    assert all(policy.topics() for policy in POLICIES)
    assert all(policy.sentence().endswith('.') for policy in POLICIES)


def test_a_whole_story_breaks_no_policy() -> None:
    trace = Trace()
    policy_cases.whole_story(trace)
    assert not trace.monitor.violations


@pytest.mark.parametrize(
    ('asking', 'broken'),
    [
        ('THRESHOLD', {'asks_only_below_the_threshold', 'acts_only_at_the_threshold'}),
        ('COST', set()),
        ('PROMISE', set()),
    ],
)
def test_a_robot_that_asks_by_something_else_need_not_keep_to_the_threshold(
    asking: str, broken: set[str]
) -> None:
    found: set[str] = set()
    for changes in (UNSURE | {'threshold': 0.2}, {'threshold': 0.95}):
        trace = Trace()
        trace.record(1, asking)
        trace.decided(**changes)
        found |= trace.broken
    assert found == broken


def test_a_driver_that_died_tells_the_end_of_a_held_motion_when_it_is_back() -> None:
    for told, broken in ((True, set()), (False, {'held_motions_end'})):
        trace = Trace()
        trace.beat(1)
        trace.motion(id='x')
        for silent in range(50):
            trace.hold(held=True)
            trace.wait(0.1)
            if silent >= 30:
                trace.beat(silent - 29, run='b', state=0, message='starting')
        assert not trace.broken
        for number in range(21, 51):
            trace.beat(number, run='b')
            trace.hold(held=True)
            trace.wait(0.1)
            if told and number == 30:
                trace.motion(2, id='x', outcome=13)
        assert trace.broken == broken


def test_a_question_waits_beside_decisions_on_other_objects() -> None:
    good, bad = Trace(), Trace()
    policy_cases.question_beside_another_decision(good)
    policy_cases.question_beside_another_decision(bad, bad=True)
    assert not good.monitor.violations
    assert bad.broken == {'one_decision_at_a_time'}


def test_it_may_ask_for_the_way_of_an_action_that_was_not_free() -> None:
    good, bad = Trace(), Trace()
    policy_cases.asked_after_not_free(good, other_action=False)
    policy_cases.asked_after_not_free(bad, other_action=True)
    assert not good.monitor.violations
    assert bad.broken == {'asks_only_below_the_threshold'}


def test_a_decision_may_follow_a_joint_goal() -> None:
    for name, broken in (('pear', set()), ('bear', {'decisions_follow_demonstrations'})):
        trace = Trace()
        trace.world()
        shown = trace.table(1)
        belief = plain(trace.table(1), demonstration=stamp(shown), objects=[name], stopped=True)
        trace.hear('joint_goal_belief', belief)
        trace.decision(trace.table(0), shown)
        assert trace.broken == broken


@pytest.mark.parametrize(('steps', 'broken'), [(7, set()), (12, {'joints_rest_unheard'})])
def test_silence_begins_when_the_last_state_arrived(steps: int, broken: set[str]) -> None:
    trace = Trace()
    trace.hold()
    # The keeper got no processor time between the stamp of its state and the sending.
    trace.hold(late=0.4)
    for number in range(20):
        trace.joints(0.5 if number < 8 + steps else 0.0)
    assert trace.broken == broken


@pytest.mark.parametrize('held', [False, True])
def test_a_driver_that_did_not_run_stops_when_it_does(held: bool) -> None:
    for steps, broken in ((2, set()), (5, {f'joints_rest_{"while_held" if held else "unheard"}'})):
        trace = Trace()
        trace.hold(change=1)
        trace.joints(0.5)
        if held:
            trace.hold(held=True, change=2)
            trace.told(held=True, change=2)
        trace.wait(1.0)
        if held:
            trace.hold(held=True, change=2)
        for number in range(8):
            trace.joints(0.5 if number < steps else 0.0)
        assert trace.broken == broken


@pytest.mark.parametrize('missed', [False, True])
def test_what_the_monitor_missed_is_not_held_against_anybody(missed: bool) -> None:
    trace = Trace()
    first = trace.table()
    trace.hold()
    if missed:
        for topic in ('cell/hold_state', 'table_state'):
            trace.monitor.miss(topic, trace.now, trace.now + 1.0)
    for _ in range(18):
        trace.joints(0.5)
    trace.frame_done(first + 0.5)
    trace.motion(id='x')
    trace.motion(2, id='x')
    trace.hold()
    trace.joints(0.5)
    judged = {'joints_rest_unheard', 'frames_read_are_told', 'no_motion_begins_unheard'}
    assert trace.broken == (set() if missed else judged)


@pytest.mark.parametrize('node', ['/perception_node', '/arm_driver', '/hold_keeper'])
def test_stamps_go_back_once_after_a_restart_of_what_makes_them(node: str) -> None:
    trace = Trace()
    trace.beat(1, node=node)
    time = trace.table()
    trace.beat(1, node=node, run='b')
    trace.table(time=time - 0.4)
    assert trace.broken == ({'stamps_rise'} if node == '/hold_keeper' else set())
    trace.table(time=time - 0.8)
    assert trace.broken == {'stamps_rise'}


def test_the_documents_table_is_that_of_the_code() -> None:
    text = (Path(__file__).parents[4] / 'docs' / 'policies.md').read_text('utf-8')
    assert text.endswith(f'\n{table()}\n')


def test_messages_from_before_the_watch_are_remembered_unchecked() -> None:
    monitor = PolicyMonitor()
    asking = plain(id=7, kind=1, object='pear', x_i=0, goal=1)
    monitor.remember('decision', asking, 1.0)
    skipped = {'decision_id': 7, 'object': 'pear', 'x_i': 0, 'goal': 1, 'x_f': 255, 'result': 4}
    monitor.hear('outcome', plain(actor=2, **skipped, **BY_NOBODY), 2.0)
    assert not monitor.violations


def test_memory_is_bounded() -> None:
    trace, sizes = Trace(), []
    for number in range(1, 2201):
        trace.decided(id=number)
        trace.motion(id=f'm{number}')
        if number % 1100 == 0:
            sizes.append(sum(len(v) for v in vars(trace.monitor.seen).values() if kept(v)))
    assert sizes[0] == sizes[1]
    assert len(trace.monitor.violations) == KEPT


def kept(value: object) -> bool:
    return isinstance(value, Recent)


def hold_state(change: int) -> Any:
    store = definitions().store
    definitions().load(TOPICS['cell/holds'])
    header = store.types['std_msgs/msg/Header'](
        stamp=store.types['builtin_interfaces/msg/Time'](1, 0), frame_id=''
    )
    fields = {'run': 'k', 'held': False, 'change': change, 'by': '', 'reason': ''}
    return definitions().make(TOPICS['cell/holds'], header=header, **fields)


@pytest.mark.parametrize(('changes', 'code'), [((1, 2), 0), ((2, 1), 1)])
def test_a_recording_is_checked(tmp_path: Path, changes: tuple[int, ...], code: int) -> None:
    topic, kind = '/cell/hold_state', TOPICS['cell/hold_state']
    with BagWriter(tmp_path / 'bag', 'mcap', False) as writer:
        writer.add(Topic(topic, kind))
        for number, change in enumerate(changes, 1):
            data = definitions().write(hold_state(change))
            writer.write(Record(topic, kind, number * 1_000_000_000, data))
    done = CliRunner().invoke(app, ['check', str(tmp_path / 'bag')])
    assert done.exit_code == code, done.output
    assert f'{code} violations of {len(POLICIES)} policies in 2 messages' in done.output
    assert ('holds_only_grow' in done.output) == bool(code)


def test_a_recording_from_before_a_field_was_added_is_checked(tmp_path: Path) -> None:
    name, kind = '/table_state', TOPICS['table_state']
    text, count = re.subn(r'.*unknown_objects\n', '', definitions().of(kind).text)
    assert count == 1
    older = Topic(name, kind, definition=text, encoding='ros2msg')
    store = typestore_of(older)
    header = store.types['std_msgs/msg/Header'](
        stamp=store.types['builtin_interfaces/msg/Time'](1, 0), frame_id='base_link'
    )
    message = store.types[kind](
        header=header, world='chung2015@0', reference_frame='base_link', camera_frame='camera',
        hand_in_view=False, arm_in_view=False, settled=False, reason='', objects=[],
    )  # fmt: skip
    with BagWriter(tmp_path / 'bag', 'mcap', False) as writer:
        writer.add(older)
        data = bytes(store.serialize_cdr(message, kind))
        writer.write(Record(name, kind, 1_000_000_000, data))
    found = check_bag(open_bag(tmp_path / 'bag'))
    assert found.unreadable == 0
    tables = found.monitor.seen.tables.values()
    assert [table.world for table in tables] == ['chung2015@0']


def test_what_is_no_recording_is_said(tmp_path: Path) -> None:
    done = CliRunner().invoke(app, ['check', str(tmp_path)])
    assert done.exit_code == 1
    assert 'Expected' in done.stderr
    assert 'Traceback' not in done.output

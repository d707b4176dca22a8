"""Every policy holds on a good trace, and is the only one that fires on a planted fault."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import policy_cases
import pytest
from policy_traces import BY_NOBODY, Trace, plain
from typer.testing import CliRunner

from likeme_bags.values import Record, Topic
from likeme_bags.writing import BagWriter
from likeme_replay.message_definitions import definitions
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


def test_what_is_no_recording_is_said(tmp_path: Path) -> None:
    done = CliRunner().invoke(app, ['check', str(tmp_path)])
    assert done.exit_code == 1
    assert 'Expected' in done.stderr
    assert 'Traceback' not in done.output

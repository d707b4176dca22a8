"""The command line of the decision log: show, why, verify, export, and their refusals."""

from __future__ import annotations

import csv
import json
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest
from session_values import ns, shown, table
from typer.testing import CliRunner, Result

from likeme_core.outcomes import MotionOutcome
from likeme_core.paper_world import LEFT, RIGHT, WORLD
from likeme_core.state_folder import state_folder
from likeme_inference.experience.decision_log import LOG_FILE, DecisionLog
from likeme_inference.help_requests import HelpRequests
from likeme_inference.log_commands import app
from likeme_inference.logged_session import LoggedSession
from likeme_inference.session_inputs import OperatorAnswer
from likeme_inference.session_log import SessionLog
from likeme_inference.tabletop.imitation import help_request
from likeme_inference.tabletop.model_file import shipped
from likeme_inference.tabletop.session import ImitationSession
from likeme_inference.tabletop.values import Decision, MotionReport, Reply


@pytest.fixture
def path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The log of a cell in which the pear was shown, asked about, tried and missed."""
    monkeypatch.setenv('LIKEME_STATE', str(tmp_path))
    place = state_folder(7) / LOG_FILE
    log = SessionLog(DecisionLog(str(place)), WORLD, 'robot/7/node', 'run')
    log.started('/inference_node', {}, '')
    here = LoggedSession(ImitationSession(shipped()), log)
    for value in (
        shown('pear', RIGHT, LEFT, 3),
        table(4, pear=LEFT),
        shown('pear', LEFT, RIGHT, 9),
    ):
        here.apply(value)
    asking = here.apply(table(10, pear=RIGHT))[0]
    assert isinstance(asking, Decision)
    desk = HelpRequests()
    desk.add(help_request(asking))
    reply = desk.check(2, Reply.TRY_ANYWAY, 'Ada')
    here.apply(OperatorAnswer(Reply.TRY_ANYWAY, 'Ada'), reply)
    log.request_motion(asking, 'some-uuid', 15)
    motion = {
        'id': 'some-uuid', 'state': 'ENDED', 'actor': 'ROBOT', 'object': 'pear',
        'action': 'push_left', 'outcome': 'COMPLETED', 'message': 'Pushed.',
    }  # fmt: skip
    log.note('motion', motion)
    log.note('motion', motion | {'id': 'of somebody else'})
    here.apply(MotionReport(MotionOutcome.COMPLETED, 'Pushed.', ns(12)))
    here.apply(table(13, pear=RIGHT))
    return place


def run(*words: str) -> Result:
    return CliRunner().invoke(app, words, env={'ROS_DOMAIN_ID': '7'})


def test_show(path: Path) -> None:
    lines = run('show').stdout.splitlines()
    assert 'MISSED: The pear is RIGHT, not LEFT: missed by PUSH_LEFT' in lines[-2]
    few = run('show', '-n', '2', '--kind', 'decision', '--json').stdout.splitlines()
    decisions = [json.loads(text) for text in few]
    assert [d['data']['decision']['id'] for d in decisions] == [1, 2]
    assert decisions[1]['data']['decision']['predicted_success'] == 0.4
    assert len(run('show', '--last', '1', '--store', str(path)).stdout.splitlines()) == 1


def test_why(path: Path) -> None:
    said = run('why', '2')
    assert said.exit_code == 0
    story = [line.split()[3] for line in said.stdout.splitlines() if line.startswith('  ')]
    assert story == [
        'demonstration', 'belief', 'decision', 'question', 'answer', 'motion_requested', 'motion',
        'motion_report', 'outcome',
    ]  # fmt: skip
    assert 'TRY_ANYWAY by Ada' in said.stdout
    assert said.stdout.endswith('re-derived: same\n')
    unknown = run('why', '99')
    assert (unknown.exit_code, unknown.stdout) == (1, '')
    assert 'Expected the number of a decision (up to 2), got 99.' in unknown.stderr


def test_why_tells_what_does_not_follow(path: Path) -> None:
    with closing(DecisionLog(str(path))) as log:
        record = next(iter(log.entries(['decision'], 1))).data
        record['decision']['predicted_success'] = 0.9
        log.append(
            'run', [('decision', json.dumps(record, sort_keys=True, separators=(',', ':')))]
        )
    said = run('why', '2')
    assert said.exit_code == 1
    assert 're-derived: it differs.' in said.stdout
    assert said.stderr == 'predicted_success: the log says 0.9, it follows 0.4.\n'


def test_verify(path: Path) -> None:
    good = run('verify')
    assert good.exit_code == 0
    assert 'intact. Head: ' in good.stdout
    head = good.stdout.split()[-1]
    assert run('verify', '--head', head[:16]).exit_code == 0
    with closing(sqlite3.connect(path)) as raw, raw:
        raw.execute('DROP TRIGGER likeme_log_no_delete')
        raw.execute('DELETE FROM likeme_log WHERE hash = ?', [head])
    cut, unaware = run('verify', '--head', head), run('verify')
    assert (cut.exit_code, unaware.exit_code) == (1, 0)
    assert cut.stderr.count('\n') == 1
    assert 'was cut off or replaced' in cut.stderr
    assert run('verify', '--head', 'nonsense').exit_code == 2
    with closing(sqlite3.connect(path)) as raw, raw:
        raw.execute('DROP TRIGGER likeme_log_no_update')
        raw.execute("UPDATE likeme_log SET text = replace(text, 'Ada', 'Bob')")
    changed = run('verify')
    assert changed.exit_code == 1
    assert 'is not what was written: its hash does not fit.' in changed.stderr
    # It can be looked at all the same.
    assert 'by Bob' in run('show').stdout


def test_export(path: Path, tmp_path: Path) -> None:
    lines = run('export').stdout.splitlines()
    assert [json.loads(text)['number'] for text in lines] == list(range(1, len(lines) + 1))
    file = tmp_path / 'log.csv'
    assert run('export', str(file)).exit_code == 0
    with file.open(newline='') as text:
        rows = list(csv.DictReader(text))
    assert len(rows) == len(lines)
    assert rows[1]['kind'] == 'demonstration'
    assert rows[1]['sentence'] == 'pear from RIGHT to LEFT by PLACE'
    assert run('export', str(tmp_path / 'nowhere' / 'log.csv')).exit_code == 1


@pytest.mark.parametrize('word', ['show', 'verify', 'export'])
def test_no_log(tmp_path: Path, word: str) -> None:
    (tmp_path / 'notes.txt').write_text('Not a database.')
    for place in ('absent.sqlite', 'notes.txt'):
        said = run(word, '--store', str(tmp_path / place))
        assert (said.exit_code, said.stdout, said.stderr.count('\n')) == (1, '', 1)

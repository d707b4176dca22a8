"""A session that is written down and taken up again goes on as if nothing had happened."""

from __future__ import annotations

import json
import random
import re
import sqlite3
from collections import Counter
from contextlib import closing
from pathlib import Path

import pytest
from random_inputs import random_inputs
from session_values import ns, shown, table

from likeme_core.outcomes import MotionOutcome
from likeme_core.paper_world import LEFT, RIGHT, WORLD
from likeme_core.tabletop import Mode
from likeme_inference.decision_record import (
    decision_record,
    recorded_world,
    rederive,
    world_record,
)
from likeme_inference.experience.decision_log import DecisionLog
from likeme_inference.experience.store_error import StoreError
from likeme_inference.logged_session import LoggedSession
from likeme_inference.session_inputs import InputValue, SessionEvent, apply_input
from likeme_inference.session_log import SessionLog
from likeme_inference.session_restore import restore
from likeme_inference.tabletop.action_selection import Kind
from likeme_inference.tabletop.imitation import ImitationSettings
from likeme_inference.tabletop.model_file import shipped
from likeme_inference.tabletop.prior import Prior
from likeme_inference.tabletop.promise import Promise
from likeme_inference.tabletop.robot_model import RobotModel
from likeme_inference.tabletop.session import ImitationSession
from likeme_inference.tabletop.session_state import Phase, SessionState
from likeme_inference.tabletop.values import Decision, MotionReport, Outcome
from likeme_inference.value_json import from_json, to_json, to_text

MODEL = shipped()
STEPS = 120


def through_text(state: SessionState) -> SessionState:
    return from_json(SessionState, json.loads(to_text(to_json(state))), WORLD)


def taken(session: ImitationSession, value: InputValue) -> list[SessionEvent] | str:
    """What an input leads to, or why it is refused."""
    try:
        return apply_input(session, value)
    except ValueError as error:
        return str(error)


def settings_for(seed: int) -> ImitationSettings:
    mode = list(Mode)[seed % len(Mode)]
    return ImitationSettings(mode=mode, turn_delay=seed % 2 / 2, concentration=0.1 * (seed % 3))


def test_every_phase_goes_on_after_being_written_and_read() -> None:
    phases: Counter[Phase] = Counter()
    suspended: Counter[int] = Counter()
    for seed in range(20):
        settings = settings_for(seed)
        whole = ImitationSession(MODEL, settings)
        parts = ImitationSession(MODEL, settings)
        for value in random_inputs(random.Random(seed), whole, STEPS):
            parts = ImitationSession(MODEL, settings, through_text(parts.state))
            phases[whole.phase] += 1
            # repr: NaN is not equal to itself.
            assert repr(taken(whole, value)) == repr(taken(parts, value)), f'seed {seed}'
            assert to_json(whole.state) == to_json(parts.state), f'seed {seed}'
            suspended[len(whole.state.suspended)] += 1
    assert min(phases[phase] for phase in Phase) > 20, phases
    assert suspended.total() - suspended[0] > 20, suspended


def logged(path: Path, settings: ImitationSettings, state: SessionState) -> LoggedSession:
    log = SessionLog(DecisionLog(str(path)), WORLD, 'robot/0/node', 'run')
    return LoggedSession(ImitationSession(MODEL, settings, state), log)


def story(events: list[SessionEvent]) -> list[tuple[object, ...]]:
    """What was decided and how it ended, without stamps."""
    return [
        (event.id, event.kind, event.action, event.object) if isinstance(event, Decision)
        else (event.decision_id, event.result, event.x_f, event.actor)
        for event in events
        if isinstance(event, (Decision, Outcome))
    ]  # fmt: skip


@pytest.mark.parametrize('seed', range(4))
def test_a_session_restored_from_its_log_after_every_step(tmp_path: Path, seed: int) -> None:
    """Without a delay before the turn, which counts anew, decisions and outcomes are the same."""
    settings = ImitationSettings(mode=list(Mode)[seed], turn_delay=0.0)
    whole = ImitationSession(MODEL, settings)
    path = tmp_path / 'log.sqlite'
    parts = logged(path, settings, SessionState())
    expected: list[SessionEvent] = []
    got: list[SessionEvent] = []
    for value in random_inputs(random.Random(100 + seed), whole, 60):
        restored = restore(parts.log)
        decided = [each for each in got if isinstance(each, Decision)]
        assert [restored.newest] == (decided[-1:] or [None])
        # The newest table state is not in the log; the camera goes on.
        restored.state.latest = parts.session.state.latest
        restored.state.last_view = parts.session.state.last_view
        restored.state.resumed_at = 0
        parts = LoggedSession(ImitationSession(MODEL, settings, restored.state), parts.log)
        outcome = taken(whole, value)
        if isinstance(outcome, str):
            with pytest.raises(ValueError, match=re.escape(outcome)):
                parts.apply(value)
        else:
            expected += outcome
            got += parts.apply(value)
    assert story(got) == story(expected)
    assert len(story(got)) > 3
    assert not DecisionLog(str(path)).verify().problem


def test_ids_go_on_after_the_last_one_of_the_log(tmp_path: Path) -> None:
    path, settings = tmp_path / 'log.sqlite', ImitationSettings()
    here = logged(path, settings, SessionState())
    for value in (shown('chicken', RIGHT, LEFT, 3), table(4, chicken=LEFT)):
        here.apply(value)
    assert here.session.decision is not None
    assert here.session.decision.id == 1
    again = logged(path, settings, restore(here.log).state)
    for value in (shown('chicken', LEFT, RIGHT, 9), table(9, chicken=RIGHT)):
        again.apply(value)
    assert again.session.decision is not None
    assert (again.session.decision.id, again.session.decision.kind) == (2, Kind.EXECUTE)
    # A replay counts from 1, is not written, and leaves the numbers alone.
    again.apply(MotionReport(MotionOutcome.COMPLETED, 'Done.', ns(20)))
    again.restart(replayed=True)
    written = len(list(DecisionLog(str(path)).entries()))
    again.apply(shown('chicken', RIGHT, LEFT, 3))
    assert again.apply(table(4, chicken=LEFT))[0].id == 1  # type: ignore[union-attr]
    assert len(list(DecisionLog(str(path)).entries())) == written
    again.restart(replayed=False)
    again.apply(shown('chicken', RIGHT, LEFT, 33))
    assert again.apply(table(34, chicken=LEFT))[0].id == 3  # type: ignore[union-attr]


def test_a_log_of_another_world_begins_anew_and_says_both_names(tmp_path: Path) -> None:
    here = logged(tmp_path / 'log.sqlite', ImitationSettings(), SessionState())
    for value in (shown('chicken', RIGHT, LEFT, 3), table(4, chicken=LEFT)):
        here.apply(value)
    other = WORLD.only('pear')
    restored = restore(SessionLog(here.log.log, other, 'robot/0/node', 'run'))
    assert restored.state == SessionState(decisions=1)
    assert WORLD.label in restored.sentence
    assert other.label in restored.sentence
    # Another cell's session in the same log is not this one's.
    assert restore(SessionLog(here.log.log, WORLD, 'robot/9/node', 'run')).state == SessionState()


@pytest.mark.parametrize('prior', list(Prior))
def test_a_decision_is_made_again_from_its_record(prior: Prior) -> None:
    session = ImitationSession(MODEL, ImitationSettings(prior=prior, turn_delay=0))
    apply_input(session, shown('pear', RIGHT, LEFT, 3))
    decision = apply_input(session, table(5, pear=RIGHT))[0]
    assert isinstance(decision, Decision)
    record = json.loads(to_text(decision_record(session, decision)))
    names = json.loads(to_text(world_record(WORLD)))
    assert rederive(record, recorded_world(names)) == []
    assert len(record['model']['counts']) == (1 if prior is Prior.OWN else 3)
    # Any number that matters, when it is another one.
    record['model']['counts'][0][1][1][3][0] += 1
    assert any('p' in difference for difference in rederive(record, recorded_world(names)))


def test_a_decision_at_the_put_back_is_made_again(tmp_path: Path) -> None:
    """It is made when the act that undoes the demonstration is told."""
    here = logged(tmp_path / 'log.sqlite', ImitationSettings(), SessionState())
    for value in (
        shown('chicken', RIGHT, LEFT, 3),
        table(3, chicken=LEFT),
        table(9, chicken=RIGHT),
    ):
        here.apply(value)
    events = here.apply(shown('chicken', LEFT, RIGHT, 9))
    assert isinstance(events[-1], Decision)
    assert here.log.log is not None
    names = json.loads(to_text(world_record(WORLD)))
    for entry in here.log.log.entries(['decision']):
        assert rederive(entry.data, recorded_world(names)) == []


@pytest.mark.parametrize('concentration', [0.0, 0.5])
def test_a_decision_on_an_object_without_trials_is_made_again(
    tmp_path: Path, concentration: float
) -> None:
    model = RobotModel(
        'few', '1', MODEL.sources, tuple(row for row in MODEL.rows if row.object != 'pear')
    )
    log = SessionLog(DecisionLog(str(tmp_path / 'log.sqlite')), WORLD, 'robot/0/node', 'run')
    settings = ImitationSettings(concentration=concentration, turn_delay=0)
    here = LoggedSession(ImitationSession(model, settings), log)
    here.apply(shown('pear', RIGHT, LEFT, 3))
    here.apply(table(5, pear=RIGHT))
    assert log.log is not None
    (entry,) = log.log.entries(['decision'])
    names = json.loads(to_text(world_record(WORLD)))
    assert rederive(entry.data, recorded_world(names)) == []
    assert entry.data['decision']['object'] == 'pear'


def test_values_that_do_not_fit_are_refused() -> None:
    good = to_json(SessionState())
    for field, value in (
        ('phase', 'FLYING'), ('spent', 'x'), ('spent', True), ('closed', ['pear']), ('actor', 3),
        ('latest', {'stamp': 1}),
    ):  # fmt: skip
        with pytest.raises(ValueError, match=r'Expected|got'):
            from_json(SessionState, good | {field: value}, WORLD)
    with pytest.raises(ValueError, match='Expected a SessionState of'):
        from_json(SessionState, {'phase': 'IDLE'}, WORLD)


def test_what_cannot_be_written_has_not_happened(tmp_path: Path) -> None:
    path = tmp_path / 'log.sqlite'
    log = SessionLog(DecisionLog(str(path), lock_timeout=0.05), WORLD, 'cell', 'run')
    now = 0.0
    log._now = lambda: now
    here = LoggedSession(ImitationSession(MODEL, ImitationSettings()), log)
    here.apply(table(2, chicken=LEFT))
    act = shown('chicken', RIGHT, LEFT, 3)
    log.note('remark', {'sentence': 'The log is there.'})
    with closing(sqlite3.connect(path, isolation_level=None)) as other:
        other.execute('BEGIN IMMEDIATE')
        before = here.session.state.copy()
        with pytest.raises(StoreError, match='is locked'):
            here.apply(act)
        assert here.session.state == before
        assert here.session.phase is Phase.IDLE
        log.note('hold', {'change': 1})
    # Not tried again at once: every attempt may block the node.
    with pytest.raises(StoreError, match='is locked'):
        here.apply(act)
    now = 2.0
    here.apply(act)
    assert (here.session.phase, log.problem) == (Phase.TURN, '')
    kinds = [entry.kind for entry in DecisionLog(str(path)).entries()]
    assert kinds == ['remark', 'remark', 'hold', 'demonstration', 'belief', 'session']


def test_an_older_log_says_whether_a_promise_was_kept(tmp_path: Path) -> None:
    promise = Promise(0.9, 0.5, recent=(True, False))
    here = logged(tmp_path / 'log.sqlite', ImitationSettings(), SessionState(promise=promise))
    here.apply(shown('chicken', RIGHT, LEFT, 3))
    assert restore(here.log).state.promise == promise


def test_a_timeout_counts_anew_after_a_restart(tmp_path: Path) -> None:
    """The outcome is waited for as long as if the motion had just ended."""
    settings = ImitationSettings(outcome_timeout=10.0)
    here = logged(tmp_path / 'log.sqlite', settings, SessionState())
    for value in (
        shown('chicken', RIGHT, LEFT, 3), table(3, chicken=LEFT),
        shown('chicken', LEFT, RIGHT, 9), table(9, chicken=RIGHT),
        MotionReport(MotionOutcome.COMPLETED, 'Done.', ns(20)),
    ):  # fmt: skip
        here.apply(value)
    again = logged(tmp_path / 'log.sqlite', settings, restore(here.log).state)
    assert again.session.phase is Phase.CONFIRMING
    for at in (100, 105, 110):
        assert again.apply(table(at, settled=False, chicken=LEFT)) == []
    (outcome,) = again.apply(table(110.1, settled=False, chicken=LEFT))
    assert isinstance(outcome, Outcome)


def test_a_changed_entry_is_not_taken_up(tmp_path: Path) -> None:
    path = tmp_path / 'log.sqlite'
    here = logged(path, ImitationSettings(), SessionState())
    here.apply(shown('chicken', RIGHT, LEFT, 3))
    with closing(sqlite3.connect(path)) as raw, raw:
        raw.execute('DROP TRIGGER likeme_log_no_update')
        raw.execute("UPDATE likeme_log SET text = replace(text, 'chicken', 'pear')")
    with pytest.raises(StoreError, match=r'entry 3 is not what was written: see log\.sh verify'):
        restore(here.log)

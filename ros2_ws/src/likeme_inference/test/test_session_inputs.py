"""What an input leads to, and which inputs are refused."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from likeme_core.observations import Demonstration, TableSnapshot
from likeme_core.outcomes import MotionOutcome
from likeme_core.paper_world import LEFT, RIGHT, WORLD
from likeme_core.tabletop import Manner
from likeme_inference.session_inputs import (
    CameraSilence,
    InputKind,
    InputValue,
    OperatorAnswer,
    apply_input,
    read_heard,
)
from likeme_inference.tabletop.model_file import shipped
from likeme_inference.tabletop.session import ImitationSession
from likeme_inference.tabletop.values import Decision, GoalBelief, MotionReport, Reply

SECOND = 1_000_000_000
HEARD = SimpleNamespace(
    motion_outcome=0, finished=SimpleNamespace(sec=3, nanosec=4), answer=2, message='Ada'
)


def demonstration(name: str) -> Demonstration:
    return Demonstration(
        10 * SECOND, 'camera', name, RIGHT, LEFT, Manner.PLACE, 8 * SECOND, 9 * SECOND
    )


def test_a_demonstration_leads_to_a_belief_and_to_a_look_at_the_newest_table() -> None:
    session = ImitationSession(shipped())
    table = TableSnapshot(10 * SECOND, 'camera', True, {'chicken': LEFT})
    assert apply_input(session, table) == []
    belief, decision = apply_input(session, demonstration('chicken'))
    assert isinstance(belief, GoalBelief)
    assert isinstance(decision, Decision)


@pytest.mark.parametrize(
    ('value', 'sentence'),
    [
        (demonstration('plum'), "world chung2015 .pear, lemon, chicken., got 'plum'"),
        (demonstration(''), "got ''"),
        (MotionReport(MotionOutcome.COMPLETED, ''), 'session in ACTING, got IDLE'),
        (OperatorAnswer(Reply.SKIP, 'Ada'), 'session in ASKING, got IDLE'),
        (CameraSilence(), 'session in CONFIRMING, got IDLE'),
    ],
)
def test_inputs_that_do_not_fit_are_refused(value: InputValue, sentence: str) -> None:
    with pytest.raises(ValueError, match=sentence):
        apply_input(ImitationSession(shipped()), value)


def test_reports_are_read_from_heard() -> None:
    report = MotionReport(MotionOutcome.COMPLETED, 'Ada', 3 * SECOND + 4)
    assert read_heard(InputKind.MOTION, HEARD, WORLD) == report
    assert read_heard(InputKind.ANSWER, HEARD, WORLD) == OperatorAnswer(Reply.SKIP, 'Ada')
    named = SimpleNamespace(**vars(HEARD) | {'answer': 3, 'goal': 'LEFT'})
    assert read_heard(InputKind.ANSWER, named, WORLD) == OperatorAnswer(
        Reply.NAME_GOAL, 'Ada', goal=LEFT
    )
    assert isinstance(read_heard(InputKind.SILENCE, HEARD, WORLD), CameraSilence)
    no_answer = SimpleNamespace(**vars(HEARD) | {'motion_outcome': 255, 'answer': 7})
    value = read_heard(InputKind.MOTION, no_answer, WORLD)
    assert isinstance(value, MotionReport)
    assert value.outcome is None
    with pytest.raises(ValueError, match='answer from 0 to 3, got 7'):
        read_heard(InputKind.ANSWER, no_answer, WORLD)
    with pytest.raises(ValueError, match='got NOTHING'):
        read_heard(InputKind.NOTHING, HEARD, WORLD)

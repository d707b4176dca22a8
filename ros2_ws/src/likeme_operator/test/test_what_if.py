"""What another mode or threshold would have decided, from the record of a real decision."""

from __future__ import annotations

import math

import pytest

from likeme_core.observations import Demonstration, TableSnapshot
from likeme_core.paper_world import WORLD
from likeme_core.tabletop import Manner, Mode
from likeme_inference.decision_record import decision_record, world_record
from likeme_inference.tabletop import shipped
from likeme_inference.tabletop.action_selection import Kind
from likeme_inference.tabletop.imitation import ImitationSettings
from likeme_inference.tabletop.session import ImitationSession
from likeme_operator.action_evidence import evidence
from likeme_operator.resume_notice import NOTHING, resume_notice
from likeme_operator.what_if import WhatIf

L, R, O = WORLD.states  # noqa: E741


@pytest.fixture
def question() -> WhatIf:
    """The pear was shown RIGHT to LEFT and is back RIGHT: p = 0.40, threshold 0.5, it asks."""
    session = ImitationSession(shipped(), ImitationSettings(world=WORLD))
    demo = Demonstration(100, 'camera', 'pear', R, L, Manner.PLACE, 90, 95)
    session.observe_demonstration(demo)
    session.look(TableSnapshot(10**9, 'camera', True, {'pear': R}))
    decision = session.look(TableSnapshot(2 * 10**9, 'camera', True, {'pear': R}))
    record = decision_record(session, decision)
    return WhatIf({**record, 'names': world_record(WORLD)})


def test_made_again_it_is_what_was_decided(question: WhatIf) -> None:
    made = question.made.decision
    assert made is not None
    assert (made.kind, made.action) == (Kind.ASK_HUMAN, WORLD.action('push_left'))
    assert question.made.line == 'interactive, threshold 0.5: asks, PUSH_LEFT, p 0.40'


def test_other_thresholds_and_modes(question: WhatIf) -> None:
    assert question.under(threshold=0.4).verb == 'acts'
    assert question.under(threshold=0.41).verb == 'asks'
    lines = {each.mode: each.line for each in question.modes()}
    assert lines[Mode.TRAJECTORY] == 'trajectory: acts, PLACE_LEFT, p 0.00'
    assert lines[Mode.GOAL_BASED] == 'goal_based: acts, PUSH_LEFT, p 0.40'
    assert lines[Mode.SEQUENTIAL].startswith('sequential, threshold 0.5: acts, PUSH_LEFT, p 0.78')
    with pytest.raises(ValueError, match='Expected a threshold from 0 to 1'):
        question.under(threshold=1.1)


def test_trials_and_intervals_behind_each_action(question: WhatIf) -> None:
    made = question.made.decision
    assert made is not None
    rows = {row.action: row for row in evidence(made, question.inputs)}
    push = rows['PUSH_LEFT']
    # Beta(4.09, 6.18), by scipy.stats.beta.ppf.
    assert (push.successes, push.trials) == (4, 10)
    assert math.isclose(push.low, 0.13846553, abs_tol=1e-6)
    assert math.isclose(push.high, 0.69539431, abs_tol=1e-6)
    assert rows['PLACE_LEFT'].successes == 0


def test_a_record_of_another_kind_is_refused() -> None:
    with pytest.raises(KeyError):
        WhatIf({'decision': {'id': 1}})


def test_what_a_resume_moves_is_told() -> None:
    assert resume_notice(False, False, False, 0) == [NOTHING]
    over = resume_notice(True, True, True, 0)
    assert over[0] == 'The hand and the arm over the table moves away from it at once.'
    assert resume_notice(True, False, False, 1)[-1].startswith('An answer `try`')
    assert 'pear' in resume_notice(True, False, False, 0, 'pear')[-1]
    assert resume_notice(None, None, None, None)[0].startswith('If hand or arm')

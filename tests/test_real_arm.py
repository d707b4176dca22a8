"""The driver of a real arm through DDS, against a stand-in robot that is not ours to command."""

from __future__ import annotations

import time

import numpy as np
import pytest

pytest.importorskip('pinocchio', reason='scripts/real_arm.lock is not installed')
pytest.importorskip('ruckig')

from arm_parts.acts import BRAKING, MOVED, Act, ActResult, carry_out
from arm_parts.live_arm import LiveArm, live_arm
from in_process import refusal
from likeme_arm.arm_driver_node import main
from likeme_core.outcomes import MotionOutcome

pytestmark = pytest.mark.graph
#: For a loaded machine, and for the tests' sake: see live_arm.
PATIENCE, HASTE = 6.0, 1.7
#: s for an answer.
ANSWER = 60.0
AWAY = {'pear': 'OFFTABLE', 'lemon': 'OFFTABLE', 'chicken': 'RIGHT'}


def act(fault: str, trajectory: int = 0, at: float = 0.4, amount: float = 0.0) -> Act:
    return Act('chicken', 'PUSH_LEFT', AWAY, fault, trajectory, at, amount, seed=3)


def nothing_broken(live: LiveArm) -> None:
    assert live.report['collisions'] == {}
    assert live.report['violations'] == {}


def at_rest(result: ActResult) -> None:
    assert result.rest < BRAKING
    assert result.after_hold < MOVED


def test_an_act_and_acts_that_go_wrong() -> None:
    with live_arm(PATIENCE, HASTE) as live:
        dropped = carry_out(live, act('drop'))
        assert dropped.outcome is MotionOutcome.FAILED
        assert 'its controller dropped it or was stopped' in dropped.message
        held = carry_out(live, act('hold'))
        assert held.outcome is MotionOutcome.HELD
        at_rest(held)
        # What was left on the way does not keep the next request from being carried out.
        done = carry_out(live, act('none'))
        assert done.outcome is MotionOutcome.COMPLETED, done.message
        assert done.arrived
        nothing_broken(live)


def test_in_step_mode_nothing_moves_until_it_is_allowed() -> None:
    with live_arm(PATIENCE, HASTE, step=True) as live:
        live.control(target='chicken', places=AWAY)
        live.during(0.5)
        answer = live.act('chicken', 'PUSH_LEFT')
        live.until(lambda: live.next_motion, ANSWER, 'a question')
        assert live.next_motion.startswith('reach, ')
        live.joints.clear()
        live.during(0.5)
        assert np.ptp([joints for _, joints in live.joints], axis=0).max() < MOVED
        allowed = live.allow(True)
        live.until(lambda: allowed.done() and not live.next_motion, ANSWER, 'a begin')
        live.until(lambda: live.next_motion.startswith('lower, '), ANSWER, 'the next question')
        live.allow(False)
        live.until(answer.done, ANSWER, 'an outcome')
        assert answer.result().outcome == MotionOutcome.HELD
        assert 'was not allowed' in answer.result().message
        nothing_asked = live.allow(True)
        live.until(nothing_asked.done, ANSWER, 'an answer')
        assert not nothing_asked.result().success
        nothing_broken(live)


def test_a_dry_run_plans_and_moves_nothing() -> None:
    with live_arm(PATIENCE, HASTE, dry_run=True) as live:
        live.control(target='chicken', places=AWAY)
        live.during(0.5)
        live.joints.clear()
        began = time.monotonic()
        answer = live.act('chicken', 'PLACE_LEFT')
        live.until(answer.done, ANSWER, 'a plan')
        live.during(max(0.0, began + 1.0 - time.monotonic()))
        assert answer.result().outcome == MotionOutcome.HELD
        assert answer.result().started.sec == 0
        message = answer.result().message
        assert message.startswith('Dry run, nothing moved: 7 motions of ')
        assert message.endswith('COMPLETED: The chicken was set down at LEFT.')
        assert np.ptp([joints for _, joints in live.joints], axis=0).max() < MOVED


@pytest.mark.parametrize(
    ('parameters', 'sentence'),
    [
        ({'arm': 'hal'}, "Expected an arm of panda, so101, ur5_gripper or a file, got 'hal'."),
        ({'controller_interface': 'serial'}, "auto, action, topic, got 'serial'"),
    ],
)
def test_bad_parameters_are_refused(parameters: dict[str, str], sentence: str) -> None:
    assert sentence in refusal(main, 'arm_driver', **parameters)

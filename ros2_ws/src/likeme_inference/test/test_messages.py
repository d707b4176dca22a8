"""What is taken from messages, and what is refused with its reason."""

from __future__ import annotations

import math
from typing import Any

import pytest
from builtin_interfaces.msg import Time
from fakes import demonstration

from likeme_core.outcomes import Actor, MotionOutcome
from likeme_core.paper_world import LEFT, PUSH_RIGHT, RIGHT, WORLD
from likeme_core.ros.time import stamp_ns, time_msg
from likeme_core.tabletop import Manner
from likeme_inference.session_inputs import (
    InputKind,
    read_demonstration,
    read_motion,
    read_table,
)
from likeme_inference.tabletop.action_selection import Kind
from likeme_inference.tabletop.values import Reply, Result
from likeme_msgs.msg import Decision, Demonstration, Heard, ObjectState, Outcome, TableState
from likeme_msgs.srv import AskHuman, ExecuteAction


@pytest.mark.parametrize(
    ('enum', 'interface'),
    [
        (Manner, Demonstration),
        (Kind, Decision), (Result, Outcome), (Actor, Outcome),
        (MotionOutcome, ExecuteAction.Request),
        (Reply, AskHuman.Request), (InputKind, Heard),
    ],
)  # fmt: skip
def test_enums_have_the_numbers_of_the_messages(enum: Any, interface: Any) -> None:
    assert {member.name: getattr(interface, member.name) for member in enum} == {
        member.name: member.value for member in enum
    }


def test_a_good_demonstration() -> None:
    msg = demonstration('pear', LEFT, RIGHT, Manner.PUSH)
    msg.header.stamp, msg.header.frame_id = Time(sec=3, nanosec=7), 'camera'
    demo = read_demonstration(msg, WORLD)

    assert (demo.stamp, demo.start, demo.end) == (3_000_000_007, 10**9, 2 * 10**9)
    assert (demo.object, demo.frame) == ('pear', 'camera')
    assert WORLD.action_of(demo.manner, demo.x_f) == PUSH_RIGHT


@pytest.mark.parametrize(
    ('field', 'value', 'why'),
    [
        ('x_i', 3, 'x_i from 0 to 2, got 3'),
        ('x_f', 255, 'x_f from 0 to 2, got 255'),
        ('x_f', 0, 'a change of state, got LEFT to LEFT'),
        ('x_i_probability', [0.9, 0.03, 0.0], 'x_i_probability to sum to 1, got 0.93'),
        ('x_f_probability', [0.5, 0.5], 'x_f_probability as 3 numbers'),
        ('x_f_probability', [1.5, -0.5, 0.0], 'numbers from 0 to 1'),
        ('x_f_probability', [math.nan, 0.5, 0.5], 'numbers from 0 to 1'),
        ('manner', 3, 'manner from 0 to 2, got 3'),
        ('manner_probability', 0.2, r'p\(manner\) from 1/3 to 1, got 0.2'),
        ('manner_probability', math.nan, 'got nan'),
        ('world', 'kitchen@0', f'the world {WORLD.label}, got kitchen@0'),
        ('start', Time(sec=5), 'an end after the start'),
    ],
)
def test_bad_demonstrations(field: str, value: Any, why: str) -> None:
    msg = demonstration('pear', LEFT, RIGHT)
    setattr(msg, field, value)

    with pytest.raises(ValueError, match=why):
        read_demonstration(msg, WORLD)


def test_unknown_states_are_omitted() -> None:
    on_border, inside = ([0.51, 0.49, 0.0], [0.95, 0.05, 0.0])
    objects = [
        ObjectState(name='pear', state=1), ObjectState(name='lemon', state=255),
        ObjectState(name='chicken', state=0, state_probability=on_border),
        ObjectState(name='cube', state=0, state_probability=inside),
    ]  # fmt: skip
    view = read_table(TableState(settled=True, objects=objects), WORLD)

    assert (view.states, view.settled) == ({'pear': RIGHT, 'cube': LEFT}, True)
    with pytest.raises(ValueError, match='state of plum from 0 to 2, got 4'):
        read_table(TableState(objects=[ObjectState(name='plum', state=4)]), WORLD)


def test_unknown_motion_outcomes() -> None:
    good = read_motion(ExecuteAction.Response(outcome=3, finished=Time(sec=4)))
    bad = read_motion(ExecuteAction.Response(outcome=77))

    assert (good.outcome, good.finished) == (MotionOutcome.HELD, 4 * 10**9)
    assert (bad.outcome, bad.message) == (None, 'expected an outcome from 0 to 14, got 77.')


def test_times() -> None:
    assert stamp_ns(time_msg(1_234_567_890_123)) == 1_234_567_890_123

"""The inputs of an imitation session, shared by the node and by replays.

Messages are read by their fields alone: rclpy's and rosbags' both serve.
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from enum import IntEnum
from typing import Any, NamedTuple, TypeVar

from likeme_core.observations import Demonstration, ObservedAttempt, TableSnapshot, is_known
from likeme_core.outcomes import MotionOutcome
from likeme_core.stamps import stamp_ns
from likeme_core.tabletop import Manner, State
from likeme_core.world import World
from likeme_inference.event_fields import UNKNOWN
from likeme_inference.tabletop.session import ImitationSession
from likeme_inference.tabletop.values import (
    Decision,
    GoalBelief,
    MotionReport,
    Outcome,
    Remark,
    Reply,
    TableGoal,
)
from likeme_inference.value_json import from_json

#: How far probabilities may be from their sum of 1.
SUM_TOLERANCE = 1e-3


class InputKind(IntEnum):
    """Kinds of inputs; the numbers of likeme_msgs/Heard."""

    TABLE_STATE = 0
    DEMONSTRATION = 1
    MOTION = 2
    ANSWER = 3
    SILENCE = 4
    #: No input: a replay asks whether the node is connected.
    NOTHING = 5
    #: A joint goal of a person who has stopped.
    TABLE_GOAL = 6

    @property
    def has_topic(self) -> bool:
        """Whether the input is a message of a topic of its own."""
        return self <= InputKind.DEMONSTRATION


class SessionInput(NamedTuple):
    """An input by kind and stamp (ns); `message`: a Heard's fields where it has no topic."""

    kind: InputKind
    stamp: int
    message: Any = None


class OperatorAnswer(NamedTuple):
    """An operator's answer to a request for help.

    Attributes:
        object: the request is about; empty: it is the last one.
        goal: that NAME_GOAL names.
    """

    reply: Reply
    answered_by: str
    object: str = ''
    goal: State | None = None


class CameraSilence:
    """The camera showed nothing new for too long while an outcome was waited for."""


InputValue = (
    TableSnapshot | Demonstration | MotionReport | OperatorAnswer | CameraSilence | TableGoal
)
SessionEvent = GoalBelief | Decision | Outcome | Remark
Number = TypeVar('Number', bound=IntEnum)


def apply_input(session: ImitationSession, value: InputValue) -> list[SessionEvent]:
    """Apply an input to a session; the events it leads to, in their order.

    Raises:
        ValueError: an object that the world lacks, or no input for the session's phase.
    """
    events: list[SessionEvent | None]
    if isinstance(value, TableSnapshot):
        events = [session.look(value)]
    elif isinstance(value, Demonstration):
        world = session.settings.world
        if value.object not in world.objects:
            raise ValueError(
                f'Expected an object of the world {world.name} ({", ".join(world.objects)}), '
                f'got {value.object!r}.'
            )
        events = [session.observe_demonstration(value), session.look_again()]
    elif isinstance(value, MotionReport):
        events = [session.motion_finished(value)]
    elif isinstance(value, TableGoal):
        events = [session.observe_table_goal(value), session.look_again()]
    elif isinstance(value, OperatorAnswer):
        events = [session.answered(value.reply, value.object, value.goal), session.named_belief()]
    else:
        events = [session.nothing_seen()]
    return [event for event in events if event is not None]


def read_demonstration(msg: Any, world: World) -> Demonstration:
    """Read a likeme_msgs/Demonstration and check every field.

    Raises:
        ValueError: a state out of range or UNKNOWN, no change of state, invalid probabilities, an
            end before the start.
    """
    world.check_label(getattr(msg, 'world', ''))
    x_i, x_f = _state(world, msg.x_i, 'x_i'), _state(world, msg.x_f, 'x_f')
    if x_i == x_f:
        raise ValueError(f'Expected a change of state, got {x_i.name} to {x_f.name}.')
    _check_probabilities(world, msg.x_i_probability, 'x_i_probability')
    _check_probabilities(world, msg.x_f_probability, 'x_f_probability')
    # The likeliest of all manners has at least an equal share.
    if not 1 / len(Manner) <= msg.manner_probability <= 1:
        raise ValueError(
            f'Expected p(manner) from 1/{len(Manner)} to 1, got {msg.manner_probability:g}.'
        )
    start, end = _times(msg)
    return Demonstration(
        stamp=stamp_ns(msg.header.stamp),
        frame=msg.header.frame_id,
        object=msg.object,
        x_i=x_i,
        x_f=x_f,
        manner=_number(Manner, msg.manner, 'manner'),
        start=start,
        end=end,
        x_i_probability=tuple(msg.x_i_probability),
        x_f_probability=tuple(msg.x_f_probability),
        manner_probability=msg.manner_probability,
        rise=msg.rise,
    )


def read_attempt(msg: Any, world: World) -> ObservedAttempt:
    """Read a likeme_msgs/Attempt and check every field.

    Raises:
        ValueError: a state out of range, x_f of an act under way, invalid probabilities, an end
            before the start.
    """
    world.check_label(msg.world)
    x_i, x_f = _state(world, msg.x_i, 'x_i'), _known(world, msg.x_f, 'x_f')
    if msg.under_way and x_f is not None:
        raise ValueError(f'Expected no x_f of an act under way, got {x_f.name}.')
    for name, state in (('x_i_probability', x_i), ('x_f_probability', x_f)):
        if state is not None:
            _check_probabilities(world, getattr(msg, name), name)
    if not 0 <= msg.manner_probability <= 1:
        raise ValueError(f'Expected p(manner) from 0 to 1, got {msg.manner_probability:g}.')
    start, end = _times(msg)
    return ObservedAttempt(
        stamp=stamp_ns(msg.header.stamp),
        frame=msg.header.frame_id,
        object=msg.object,
        x_i=x_i,
        x_f=x_f,
        manner=None if msg.manner == UNKNOWN else _number(Manner, msg.manner, 'manner'),
        manner_probability=msg.manner_probability,
        direction=_known(world, msg.direction, 'direction'),
        under_way=msg.under_way,
        start=start,
        end=end,
        x_i_probability=tuple(msg.x_i_probability),
        x_f_probability=() if x_f is None else tuple(msg.x_f_probability),
    )


def read_table(msg: Any, world: World) -> TableSnapshot:
    """Read a likeme_msgs/TableState; objects whose state is not known are left out.

    Raises:
        ValueError: a state out of range.
    """
    world.check_label(getattr(msg, 'world', ''))
    # Messages recorded before there were worlds.
    unknown = {UNKNOWN} if hasattr(msg, 'world') else {UNKNOWN, 3}
    states = {
        item.name: _state(world, item.state, f'state of {item.name}')
        for item in msg.objects
        if item.state not in unknown and is_known(item.state_probability)
    }
    # Messages recorded before camera_frame have the camera's frame in their header.
    camera = getattr(msg, 'camera_frame', '') or msg.header.frame_id
    return TableSnapshot(stamp_ns(msg.header.stamp), camera, msg.settled, states)


def read_motion(response: Any) -> MotionReport:
    """Read the response of arm/execute_action; an undefined outcome counts as no response."""
    if response.outcome not in set(MotionOutcome):
        message = f'expected an outcome from 0 to {max(MotionOutcome)}, got {response.outcome}.'
        return MotionReport(None, message)
    outcome = MotionOutcome(response.outcome)
    return MotionReport(outcome, response.message, stamp_ns(response.finished))


def read_heard(kind: InputKind, heard: Any, world: World) -> InputValue:
    """Read an input without a topic from a likeme_msgs/Heard.

    Raises:
        ValueError: it holds none of this kind, or a goal that the world lacks.
    """
    if kind is InputKind.MOTION:
        known = heard.motion_outcome in set(MotionOutcome)
        outcome = MotionOutcome(heard.motion_outcome) if known else None
        return MotionReport(outcome, heard.message, stamp_ns(heard.finished))
    if kind is InputKind.ANSWER:
        reply = _number(Reply, heard.answer, 'answer')
        # Messages recorded before there could be several questions lack the object.
        about, goal = getattr(heard, 'object', ''), getattr(heard, 'goal', '')
        named = world.state(goal) if goal else None
        return OperatorAnswer(reply, heard.message or '?', about, named)
    if kind is InputKind.SILENCE:
        return CameraSilence()
    if kind is InputKind.TABLE_GOAL:
        return from_json(TableGoal, json.loads(heard.message), world)
    raise ValueError(f'Expected MOTION, ANSWER, SILENCE or TABLE_GOAL, got {kind.name}.')


def _state(world: World, value: int, field: str) -> State:
    state = world.state_at(value)
    if state is None:
        raise ValueError(f'Expected {field} from 0 to {len(world.states) - 1}, got {value}.')
    return state


def _known(world: World, value: int, field: str) -> State | None:
    return None if value == UNKNOWN else _state(world, value, field)


def _times(msg: Any) -> tuple[int, int]:
    """Start and end of an act, ns."""
    start, end = stamp_ns(msg.start), stamp_ns(msg.end)
    if end < start:
        raise ValueError(f'Expected an end after the start at {start} ns, got {end} ns.')
    return start, end


def _number(kind: type[Number], value: int, field: str) -> Number:
    if value not in set(kind):
        raise ValueError(f'Expected {field} from 0 to {max(kind)}, got {value}.')
    return kind(value)


def _check_probabilities(world: World, probability: Sequence[float], field: str) -> None:
    p, count = list(probability), len(world.states)
    if len(p) != count or not all(0 <= value <= 1 for value in p):
        raise ValueError(f'Expected {field} as {count} numbers from 0 to 1, got {p}.')
    if not math.isclose(sum(p), 1.0, abs_tol=SUM_TOLERANCE):
        raise ValueError(f'Expected {field} to sum to 1, got {sum(p):g}.')

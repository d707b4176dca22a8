"""Between likeme_msgs and the values of the tabletop model; what is wrong raises ValueError."""

from __future__ import annotations

import math
from collections.abc import Container, Sequence
from enum import IntEnum
from typing import Any, TypeVar

from std_msgs.msg import Header

from likeme_core.observations import Demonstration, TableSnapshot
from likeme_core.outcomes import MotionOutcome
from likeme_core.ros.time import stamp_ns, time_msg
from likeme_core.tabletop import Action, Manner, State
from likeme_inference.tabletop.values import (
    Decision,
    GoalBelief,
    HelpRequest,
    MotionReport,
    Outcome,
    Reply,
)
from likeme_msgs.msg import Decision as DecisionMsg
from likeme_msgs.msg import Demonstration as DemonstrationMsg
from likeme_msgs.msg import GoalBelief as GoalBeliefMsg
from likeme_msgs.msg import Heard, ObjectState, TableState
from likeme_msgs.msg import HelpRequest as HelpRequestMsg
from likeme_msgs.msg import Outcome as OutcomeMsg
from likeme_msgs.srv import ExecuteAction

#: "None" where a message has a number for an action or a motion outcome.
NONE = 255
#: How far probabilities may be from their sum of 1.
SUM_TOLERANCE = 1e-3

Number = TypeVar('Number', bound=IntEnum)


def _header(stamp: int, frame: str) -> Header:
    return Header(stamp=time_msg(stamp), frame_id=frame)


def _number(kind: type[Number], value: int, field: str) -> Number:
    if value not in set(kind):
        raise ValueError(f'Expected {field} from 0 to {max(kind)}, got {value}.')
    return kind(value)


def _check_probabilities(probability: Sequence[float], field: str) -> None:
    p = list(probability)
    if len(p) != len(State) or not all(0 <= value <= 1 for value in p):
        raise ValueError(f'Expected {field} as {len(State)} numbers from 0 to 1, got {p}.')
    if not math.isclose(sum(p), 1.0, abs_tol=SUM_TOLERANCE):
        raise ValueError(f'Expected {field} to sum to 1, got {sum(p):g}.')


def read_demonstration(msg: DemonstrationMsg, known: Container[str]) -> Demonstration:
    """Read a demonstration, believing nothing unchecked.

    Raises:
        ValueError: object not known, state out of range or UNKNOWN, no change, probabilities that
            are none, act ended before it began.
    """
    if msg.object not in known:
        raise ValueError(f'Expected an object the robot has tried, got {msg.object!r}.')
    x_i, x_f = _number(State, msg.x_i, 'x_i'), _number(State, msg.x_f, 'x_f')
    if x_i == x_f:
        raise ValueError(f'Expected a change of state, got {x_i.name} to {x_f.name}.')
    _check_probabilities(msg.x_i_probability, 'x_i_probability')
    _check_probabilities(msg.x_f_probability, 'x_f_probability')
    if not 0.5 <= msg.manner_probability <= 1:
        raise ValueError(f'Expected p(manner) from 0.5 to 1, got {msg.manner_probability:g}.')
    start, end = stamp_ns(msg.start), stamp_ns(msg.end)
    if end < start:
        raise ValueError(f'Expected an end after the start at {start} ns, got {end} ns.')
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


def read_table(msg: TableState) -> TableSnapshot:
    """Read what is where; objects in UNKNOWN state are left out.

    Raises:
        ValueError: a state out of range.
    """
    states = {
        item.name: _number(State, item.state, f'state of {item.name}')
        for item in msg.objects
        if item.state != ObjectState.UNKNOWN
    }
    return TableSnapshot(stamp_ns(msg.header.stamp), msg.header.frame_id, msg.settled, states)


def read_motion(answer: ExecuteAction.Response) -> MotionReport:
    """Read the arm's answer; an outcome that is none counts as no answer."""
    if answer.outcome not in set(MotionOutcome):
        message = f'expected an outcome from 0 to {max(MotionOutcome)}, got {answer.outcome}.'
        return MotionReport(None, message)
    return MotionReport(MotionOutcome(answer.outcome), answer.message, stamp_ns(answer.finished))


def motion_fields(report: MotionReport) -> dict[str, Any]:
    """The fields of Heard that say what became of a call to the arm."""
    outcome = NONE if report.outcome is None else int(report.outcome)
    finished = time_msg(report.finished)
    return {'motion_outcome': outcome, 'finished': finished, 'message': report.message}


def heard_motion(said: Heard) -> MotionReport:
    """Read those fields."""
    outcome = (
        MotionOutcome(said.motion_outcome) if said.motion_outcome in set(MotionOutcome) else None
    )
    return MotionReport(outcome, said.message, stamp_ns(said.finished))


def heard_reply(said: Heard) -> Reply:
    """Read a recorded answer.

    Raises:
        ValueError: it is no Reply.
    """
    return _number(Reply, said.answer, 'answer')


def execute_request(name: str, action: Action, expires: int) -> ExecuteAction.Request:
    """Word a request to the arm; `expires` in ns of ROS time."""
    return ExecuteAction.Request(object=name, action=action, expires=time_msg(expires))


def belief_msg(belief: GoalBelief) -> GoalBeliefMsg:
    """Message of a belief."""
    return GoalBeliefMsg(
        header=_header(belief.stamp, belief.frame),
        object=belief.object,
        x_i=belief.x_i,
        x_f=belief.x_f,
        prior=belief.prior,
        posterior=belief.posterior,
        goal=belief.goal,
        model=belief.model,
    )


def decision_msg(decision: Decision) -> DecisionMsg:
    """Message of a decision."""
    return DecisionMsg(
        header=_header(decision.stamp, decision.frame),
        id=decision.id,
        demonstration=time_msg(decision.demonstration),
        mode=str(decision.mode),
        object=decision.object,
        x_i=decision.x_i,
        goal=decision.goal,
        goal_posterior=decision.goal_posterior,
        kind=decision.kind,
        action=NONE if decision.action is None else decision.action,
        action_probability=decision.action_probability,
        success_probability=decision.success_probability,
        predicted=decision.predicted,
        predicted_success=decision.predicted_success,
        actions_left=decision.actions_left,
        plan_success=decision.plan_success,
        plan_value=decision.plan_value,
        threshold=decision.threshold,
        policy=str(decision.policy),
        model=decision.model,
        sentence=decision.sentence,
    )


def request_msg(request: HelpRequest) -> HelpRequestMsg:
    """Message of a question."""
    return HelpRequestMsg(
        header=_header(request.stamp, request.frame),
        id=request.id,
        object=request.object,
        x_i=request.x_i,
        goal=request.goal,
        action=request.action,
        predicted_success=request.predicted_success,
        threshold=request.threshold,
        question=request.question,
    )


def outcome_msg(outcome: Outcome) -> OutcomeMsg:
    """Message of an outcome."""
    return OutcomeMsg(
        header=_header(outcome.stamp, outcome.frame),
        decision_id=outcome.decision_id,
        object=outcome.object,
        x_i=outcome.x_i,
        goal=outcome.goal,
        x_f=ObjectState.UNKNOWN if outcome.x_f is None else outcome.x_f,
        result=outcome.result,
        actor=outcome.actor,
        action=NONE if outcome.action is None else outcome.action,
        predicted_success=outcome.predicted_success,
        motion_outcome=NONE if outcome.motion is None else outcome.motion,
        sentence=outcome.sentence,
    )

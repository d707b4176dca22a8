"""Values of the tabletop model as messages of likeme_msgs."""

from __future__ import annotations

from typing import Any

from std_msgs.msg import Header

from likeme_core.ros.time import time_msg
from likeme_core.tabletop import Action
from likeme_core.world import World
from likeme_inference.event_fields import NONE, belief_fields, decision_fields, outcome_fields
from likeme_inference.tabletop.values import (
    Decision,
    GoalBelief,
    HelpRequest,
    MotionReport,
    Outcome,
)
from likeme_msgs.msg import Decision as DecisionMsg
from likeme_msgs.msg import GoalBelief as GoalBeliefMsg
from likeme_msgs.msg import HelpRequest as HelpRequestMsg
from likeme_msgs.msg import Outcome as OutcomeMsg
from likeme_msgs.srv import ExecuteAction


def _header(stamp: int, frame: str) -> Header:
    return Header(stamp=time_msg(stamp), frame_id=frame)


def motion_fields(report: MotionReport) -> dict[str, Any]:
    """The fields of Heard that hold the report of an arm motion."""
    outcome = NONE if report.outcome is None else int(report.outcome)
    finished = time_msg(report.finished)
    return {'motion_outcome': outcome, 'finished': finished, 'message': report.message}


def execute_request(
    world: World, name: str, action: Action, expires: int, motion_id: str = ''
) -> ExecuteAction.Request:
    """Request of a motion; `expires` in ns of ROS time; no id: the driver gives it one."""
    return ExecuteAction.Request(
        object=name,
        action=action.name,
        world=world.label,
        expires=time_msg(expires),
        id=motion_id,
    )


def belief_msg(world: World, belief: GoalBelief) -> GoalBeliefMsg:
    """Message of a belief."""
    header = _header(belief.stamp, belief.frame)
    return GoalBeliefMsg(header=header, world=world.label, **belief_fields(belief))


def decision_msg(world: World, decision: Decision) -> DecisionMsg:
    """Message of a decision."""
    fields = decision_fields(decision) | {'demonstration': time_msg(decision.demonstration)}
    header = _header(decision.stamp, decision.frame)
    return DecisionMsg(header=header, world=world.label, **fields)


def request_msg(world: World, request: HelpRequest) -> HelpRequestMsg:
    """Message of a request for help."""
    return HelpRequestMsg(
        header=_header(request.stamp, request.frame),
        id=request.id,
        world=world.label,
        object=request.object,
        x_i=request.x_i,
        goal=request.goal,
        action=request.action,
        predicted_success=request.predicted_success,
        threshold=request.threshold,
        question=request.question,
        options=request.options,
    )


def outcome_msg(world: World, outcome: Outcome) -> OutcomeMsg:
    """Message of an outcome."""
    header = _header(outcome.stamp, outcome.frame)
    return OutcomeMsg(header=header, world=world.label, **outcome_fields(outcome))

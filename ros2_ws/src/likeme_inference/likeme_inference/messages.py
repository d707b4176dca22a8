"""Values of the tabletop model as messages of likeme_msgs."""

from __future__ import annotations

import math
from typing import Any

from std_msgs.msg import Header

from likeme_core.ros.time import time_msg
from likeme_core.tabletop import Action
from likeme_core.world import World
from likeme_inference.event_fields import NONE, belief_fields, decision_fields, outcome_fields
from likeme_inference.joint_belief import JointBelief
from likeme_inference.tabletop.calibration import Calibration
from likeme_inference.tabletop.promise import Promise
from likeme_inference.tabletop.values import (
    Decision,
    GoalBelief,
    HelpRequest,
    MotionReport,
    Outcome,
)
from likeme_msgs.msg import Calibration as CalibrationMsg
from likeme_msgs.msg import Decision as DecisionMsg
from likeme_msgs.msg import GoalBelief as GoalBeliefMsg
from likeme_msgs.msg import HelpRequest as HelpRequestMsg
from likeme_msgs.msg import JointGoalBelief
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
        kind=int(request.kind),
    )


def outcome_msg(world: World, outcome: Outcome) -> OutcomeMsg:
    """Message of an outcome."""
    header = _header(outcome.stamp, outcome.frame)
    return OutcomeMsg(header=header, world=world.label, **outcome_fields(outcome))


def calibration_msg(
    world: World, calibration: Calibration, promise: Promise | None, outcome: Outcome
) -> CalibrationMsg:
    """Message of what was promised and kept. promise: if one is kept; outcome: the latest."""
    message = CalibrationMsg(
        header=_header(outcome.stamp, outcome.frame), world=world.label,
        promised=calibration.promised, realised=calibration.realised,
        n=len(calibration.actions), target=math.nan, kept=math.nan,
        sentence=calibration.sentence(promise),
    )  # fmt: skip
    if promise is not None:
        message.target, message.kept = promise.target, promise.kept
        message.episodes = len(promise.recent)
    return message


def joint_belief_msg(world: World, belief: JointBelief) -> JointGoalBelief:
    """Message of a belief in goals over all objects."""
    numbers = [g for change, _ in belief.changes for g in change]
    return JointGoalBelief(
        header=_header(belief.stamp, belief.frame),
        world=world.label,
        demonstration=time_msg(belief.demonstration),
        stopped=belief.stopped,
        objects=list(belief.objects),
        probability=[p for _, p in belief.changes],
        description=list(belief.descriptions),
        changes=[JointGoalBelief.UNKNOWN if g is None else g for g in numbers],
        marginals=belief.marginals.ravel().tolist(),
        p_value=belief.p_value,
        none_of_these=belief.none_of_these,
        level=belief.level,
        rationality=belief.rationality,
        events=belief.events,
        unexplained=belief.unexplained,
        sentence=belief.sentence,
    )

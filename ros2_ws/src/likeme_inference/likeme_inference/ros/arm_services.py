"""The arm's services, and its heartbeats, for an ArmCall."""

from __future__ import annotations

from typing import Any

from rclpy.node import Node

from likeme_core.outcomes import MotionOutcome
from likeme_core.ros.heartbeat import HeartbeatSubscriber
from likeme_core.stamps import stamp_ns
from likeme_inference.arm_call import ArmServices
from likeme_inference.arm_motion import ArmHeartbeats, MotionState, StatusReport
from likeme_inference.session_inputs import read_motion
from likeme_inference.tabletop.values import MotionReport
from likeme_msgs.srv import ExecuteAction, MotionStatus


def arm_services(node: Node) -> ArmServices:
    """Clients of arm/execute_action and arm/motion_status."""
    return ArmServices(
        node.create_client(ExecuteAction, 'arm/execute_action'),
        node.create_client(MotionStatus, 'arm/motion_status'),
        read_motion,
        lambda motion_id: MotionStatus.Request(id=motion_id, refuse_unknown=True),
        lambda response: read_status(response.motion),
    )


def arm_heartbeats(node: Node, arm_node: str) -> ArmHeartbeats:
    """The health of the arm driver, a node in the same namespace unless its name begins with /."""
    inside = node.get_namespace().rstrip('/')
    name = arm_node if arm_node.startswith('/') else f'{inside}/{arm_node}'
    return ArmHeartbeats(HeartbeatSubscriber(node).monitor, name)


def read_status(motion: Any) -> StatusReport:
    """Read a likeme_msgs/Motion; what cannot be understood is UNDER_WAY, so it is asked again."""
    if motion.state not in set(MotionState) or (
        motion.state == MotionState.ENDED and motion.outcome not in set(MotionOutcome)
    ):
        return StatusReport(MotionState.UNDER_WAY, MotionReport(None, ''))
    state = MotionState(motion.state)
    outcome = MotionOutcome(motion.outcome) if state is MotionState.ENDED else None
    return StatusReport(state, MotionReport(outcome, motion.message, stamp_ns(motion.finished)))

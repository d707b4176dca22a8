"""QoS profiles."""

from __future__ import annotations

from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy


def kept(depth: int) -> QoSProfile:
    """Late subscribers receive the last messages, `depth` of them."""
    return QoSProfile(depth=depth, durability=DurabilityPolicy.TRANSIENT_LOCAL)


#: Late subscribers receive the last message.
LATCHED = kept(1)
#: Subscription to camera topics: newest frames, without retransmission.
CAMERA = QoSProfile(depth=2, reliability=ReliabilityPolicy.BEST_EFFORT)

"""QoS profiles."""

from __future__ import annotations

from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions


def kept(depth: int) -> QoSProfile:
    """Late subscribers receive the last messages, `depth` of them."""
    return QoSProfile(depth=depth, durability=DurabilityPolicy.TRANSIENT_LOCAL)


#: Late subscribers receive the last message.
LATCHED = kept(1)
#: Subscription to camera topics: newest frames, without retransmission.
CAMERA = QoSProfile(depth=2, reliability=ReliabilityPolicy.BEST_EFFORT)
#: For topics whose history, depth and reliability may be set by parameters when a node starts:
#: qos_overrides./TOPIC.subscription.reliability and so on.
OVERRIDABLE = QoSOverridingOptions.with_default_policies()

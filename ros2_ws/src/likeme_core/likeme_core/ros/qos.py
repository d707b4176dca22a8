"""QoS profiles."""

from __future__ import annotations

from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

#: Late subscribers receive the last message.
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
#: Subscription to camera topics: newest frames, without retransmission.
CAMERA = QoSProfile(depth=2, reliability=ReliabilityPolicy.BEST_EFFORT)

"""Tells a running perception_node to begin anew."""

from __future__ import annotations

import rclpy
from rclpy.signals import SignalHandlerOptions
from std_srvs.srv import Trigger

from likeme_core.cli import set_discovery
from likeme_replay.ros.waiting_node import WaitingNode

#: s for the service to appear, and to answer.
_TIMEOUT = 8.0


def reset_perception(domain: int, network: bool) -> str:
    """Call perception/reset; what it answered, or that nobody did."""
    set_discovery(network)
    rclpy.init(args=[], domain_id=domain, signal_handler_options=SignalHandlerOptions.NO)
    try:
        node = WaitingNode('teach')
        try:
            client = node.create_client(Trigger, 'perception/reset')
            if not node.wait(client.service_is_ready, _TIMEOUT):
                return f'No perception_node runs on ROS domain {domain}: nothing to begin anew.'
            future = client.call_async(Trigger.Request())
            if not node.wait(future.done, _TIMEOUT):
                return 'perception_node did not answer perception/reset: call it again.'
            return f'perception_node: {future.result().message}'
        finally:
            node.close()
    finally:
        rclpy.try_shutdown()

"""An arm that takes a request and never answers, in a process of its own that tests kill."""

from __future__ import annotations

import threading
from contextlib import suppress
from typing import Any

import rclpy
from rclpy.executors import ExternalShutdownException

from likeme_msgs.srv import ExecuteAction


def main() -> None:
    """Serve until killed."""
    rclpy.init()
    node = rclpy.create_node('fake_arm')

    def execute(request: Any, response: Any) -> Any:
        node.get_logger().info(f'Request: action {request.action} {request.object}')
        threading.Event().wait()
        return response

    node.create_service(ExecuteAction, 'arm/execute_action', execute)
    with suppress(KeyboardInterrupt, ExternalShutdownException):
        rclpy.spin(node)


if __name__ == '__main__':
    main()

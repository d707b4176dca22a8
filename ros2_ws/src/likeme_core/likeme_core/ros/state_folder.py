"""The state folder of the cell that a node belongs to."""

from __future__ import annotations

from pathlib import Path

from rclpy.node import Node

from likeme_core.state_folder import state_folder


def state_folder_of(node: Node) -> Path:
    """The folder of the node's domain and namespace, see likeme_core.state_folder.

    Raises:
        OSError: it cannot be made.
    """
    return state_folder(node.context.get_domain_id(), node.get_namespace())

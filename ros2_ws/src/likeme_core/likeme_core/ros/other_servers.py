"""Finds other nodes that serve what this node serves."""

from __future__ import annotations

from collections.abc import Iterable

from rclpy.node import Node, NodeNameNonExistentError


def other_servers(node: Node, services: Iterable[str]) -> list[str]:
    """One sentence for each of the services that a node of another name serves too.

    A node of the same name is a killed predecessor: the graph lists it until its lease ends.
    """
    wanted = {node.resolve_service_name(name): name for name in services}
    own = node.get_name(), node.get_namespace()
    return [
        f'{wanted[service]} is served by node {name} too: leave that part out of `simulate`.'
        for name, namespace in node.get_node_names_and_namespaces()
        if (name, namespace) != own
        for service in _services_of(node, name, namespace)
        if service in wanted
    ]


def _services_of(node: Node, name: str, namespace: str) -> list[str]:
    try:
        served = node.get_service_names_and_types_by_node(name, namespace)
    except NodeNameNonExistentError:
        # It has ended since the list was made.
        return []
    return [service for service, _ in served]

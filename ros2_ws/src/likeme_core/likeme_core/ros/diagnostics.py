"""One-component DiagnosticArray messages."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from importlib.metadata import PackageNotFoundError, version

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.node import Node


class DiagnosticsPublisher:
    """Publishes /diagnostics, which all cells share: names begin with the node's namespace."""

    def __init__(self, node: Node) -> None:
        self._prefix = f'{node.get_namespace().strip("/")}/'.removeprefix('/')
        self._publisher = node.create_publisher(DiagnosticArray, '/diagnostics', 10)

    def publish(self, array: DiagnosticArray) -> None:
        """Publish an array, its names changed."""
        for status in array.status:
            status.name = self._prefix + status.name
        self._publisher.publish(array)


def diagnostics_msg(
    name: str,
    level: bytes,
    message: str,
    values: Mapping[str, object],
    stamp: Time,
    hardware_id: str = 'likeme',
) -> DiagnosticArray:
    """The status of one component, with the version of the software.

    level: a constant of DiagnosticStatus.
    """
    status = DiagnosticStatus(
        level=level,
        name=name,
        message=message,
        hardware_id=hardware_id,
        values=[
            KeyValue(key=key, value=str(value))
            for key, value in {**values, 'version': software_version()}.items()
        ],
    )
    array = DiagnosticArray(status=[status])
    array.header.stamp = stamp
    return array


@cache
def software_version() -> str:
    """The version of the installed software; 'unknown' in a tree that is not installed."""
    try:
        return version('likeme_core')
    except PackageNotFoundError:
        return 'unknown'

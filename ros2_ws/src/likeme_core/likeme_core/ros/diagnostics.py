"""One-component DiagnosticArray messages."""

from __future__ import annotations

from collections.abc import Mapping

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue


def diagnostics_msg(
    name: str,
    level: bytes,
    message: str,
    values: Mapping[str, object],
    stamp: Time,
    hardware_id: str = 'likeme',
) -> DiagnosticArray:
    """The status of one component; `level` is a constant of DiagnosticStatus."""
    status = DiagnosticStatus(
        level=level,
        name=name,
        message=message,
        hardware_id=hardware_id,
        values=[KeyValue(key=key, value=str(value)) for key, value in values.items()],
    )
    array = DiagnosticArray(status=[status])
    array.header.stamp = stamp
    return array

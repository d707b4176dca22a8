"""One-component DiagnosticArray messages."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from importlib.metadata import PackageNotFoundError, version

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

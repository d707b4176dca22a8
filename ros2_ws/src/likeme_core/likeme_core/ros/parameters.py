"""Declaration of a node's parameters from its table of settings."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.node import Node
from rclpy.parameter import Parameter

from likeme_core.ros.run_memory import keep_parameters
from likeme_core.settings import Setting


def descriptor(setting: Setting) -> ParameterDescriptor:
    """Descriptor of a parameter: description, range, whether its type may change."""
    described = ParameterDescriptor(description=setting.description, read_only=setting.read_only)
    # An empty list has no element type, and lists of integers and of floats differ in type.
    described.dynamic_typing = isinstance(setting.default, list)
    if setting.limits is None:
        return described
    least, greatest = setting.limits
    if isinstance(setting.default, int):
        span = IntegerRange(from_value=int(least), to_value=int(greatest), step=1)
        described.integer_range = [span]
    else:
        # An int would be serialised as the bits of an integer.
        floats = FloatingPointRange(from_value=float(least), to_value=float(greatest))
        described.floating_point_range = [floats]
    return described


def declare(node: Node, settings: Mapping[str, Setting]) -> None:
    """Declare all parameters of a node, as they were set in this run of the cell."""
    for name, setting in settings.items():
        node.declare_parameter(name, setting.default, descriptor(setting))
    keep_parameters(node, settings)


def values(
    node: Node, settings: Mapping[str, Setting], changes: Iterable[Parameter] = ()
) -> dict[str, Any]:
    """All values by name, as they are, or would be after some changes."""
    now = {name: node.get_parameter(name).value for name in settings}
    return now | {change.name: change.value for change in changes if change.name in settings}

"""ROS parameters of the inference node: declared, validated as a set, then applied."""

from __future__ import annotations

from array import array
from collections.abc import Callable, Mapping
from typing import Any

from rcl_interfaces.msg import SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter

from likeme_core.ros import parameters
from likeme_core.settings import Setting

Values = dict[str, Any]


class NodeParameters:
    """Declares all parameters of node_settings on a node and keeps them consistent."""

    def __init__(
        self,
        node: Node,
        settings: Mapping[str, Setting],
        validate: Callable[[Values, set[str]], None],
        apply: Callable[[Values, set[str]], None],
    ) -> None:
        """Declare the parameters.

        Args:
            node: that has them.
            settings: see node_settings.settings_of.
            validate: given all values and the names of those that change; raises ValueError to
                reject the change.
            apply: given the same, after the parameters are set.
        """
        self._node, self._validate, self._apply = node, validate, apply
        self._settings = settings
        parameters.declare(node, settings)

    def watch(self) -> None:
        """Validate and apply changes from now on."""
        self._node.add_on_set_parameters_callback(self._on_set)
        self._node.add_post_set_parameters_callback(self._on_changed)

    def values(self) -> Values:
        """All current values."""
        return parameters.values(self._node, self._settings)

    def _on_set(self, changes: list[Parameter]) -> SetParametersResult:
        new = {p.name: p.value for p in changes}
        try:
            self._validate(self.values() | new, set(new))
        except ValueError as error:
            self._node.get_logger().warning(f'Parameters refused: {error}')
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _on_changed(self, changes: list[Parameter]) -> None:
        self._apply(self.values(), {p.name for p in changes})
        changed = ', '.join(f'{p.name} = {plain(p.value)!r}' for p in changes)
        self._node.get_logger().info(f'From the next decision on: {changed}.')


def plain(value: Any) -> Any:
    """Arrays as lists."""
    return list(value) if isinstance(value, (array, tuple)) else value

"""The inference node's parameters over ROS: declared, judged before they count, then taken up."""

from __future__ import annotations

from array import array
from collections.abc import Callable
from typing import Any

from rcl_interfaces.msg import SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter

from likeme_core.ros import parameters
from likeme_inference.node_settings import SETTINGS

Values = dict[str, Any]


class NodeParameters:
    """Declares all parameters of node_settings on a node and keeps them consistent."""

    def __init__(
        self,
        node: Node,
        judge: Callable[[Values, set[str]], None],
        take_up: Callable[[Values, set[str]], None],
    ) -> None:
        """Declare.

        judge: raises ValueError for values that make no sense together; all values and the names
        of those that change. take_up: what follows from them, once they are set.
        """
        self._node, self._judge, self._take_up = node, judge, take_up
        parameters.declare(node, SETTINGS)

    def watch(self) -> None:
        """Judge and take up changes from now on."""
        self._node.add_on_set_parameters_callback(self._check)
        self._node.add_post_set_parameters_callback(self._apply)

    def values(self) -> Values:
        """All values as they are."""
        return parameters.values(self._node, SETTINGS)

    def _check(self, changes: list[Parameter]) -> SetParametersResult:
        new = {p.name: p.value for p in changes}
        try:
            self._judge(self.values() | new, set(new))
        except ValueError as error:
            self._node.get_logger().warning(f'Parameters refused: {error}')
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _apply(self, changes: list[Parameter]) -> None:
        self._take_up(self.values(), {p.name for p in changes})
        changed = ', '.join(f'{p.name} = {_plain(p.value)!r}' for p in changes)
        self._node.get_logger().info(f'From the next decision on: {changed}.')


def _plain(value: Any) -> Any:
    """Arrays as lists, as people write them."""
    return list(value) if isinstance(value, (array, tuple)) else value

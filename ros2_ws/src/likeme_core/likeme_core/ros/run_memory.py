"""Has a node that is started again in the same run of the cell take up what was set on it."""

from __future__ import annotations

from array import array
from collections.abc import Mapping
from functools import partial
from typing import Any
from weakref import WeakKeyDictionary

from rclpy.node import Node
from rclpy.parameter import Parameter

from likeme_core.run_memory import RunMemory
from likeme_core.settings import Setting
from likeme_core.state_folder import state_folder

_MEMORIES: WeakKeyDictionary[Node, RunMemory] = WeakKeyDictionary()


def memory_of(node: Node) -> RunMemory:
    """What the run has kept of a node."""
    if node not in _MEMORIES:
        # Without the node, which would else be kept for ever.
        folder = partial(state_folder, node.context.get_domain_id(), node.get_namespace())
        _MEMORIES[node] = RunMemory(folder, node.get_name())
    return _MEMORIES[node]


def save(node: Node, what: str) -> None:
    """Keep it; what: that was set, for the warning if it cannot be."""
    try:
        memory_of(node).save()
    except OSError as error:
        node.get_logger().warning(
            f'{what} is in force, and will be lost if this node is started again: {error}'
        )


def keep_parameters(node: Node, settings: Mapping[str, Setting]) -> None:
    """Set declared parameters as they were set in this run, and keep what is set from now on."""
    memory = memory_of(node)
    if not memory.run:
        return
    kept = {name for name, setting in settings.items() if setting.kept and not setting.read_only}
    before = {name: value for name, value in memory.parameters.items() if name in kept}
    if before:
        results = node.set_parameters([Parameter(n, value=value) for n, value in before.items()])
        taken = []
        for (name, value), result in zip(before.items(), results, strict=True):
            if result.successful:
                taken.append(f'{name} = {value!r}')
            else:
                now = node.get_parameter(name).value
                node.get_logger().warning(
                    f'{name} is {now!r}: {value!r}, as set in this run, is refused: '
                    f'{result.reason}'
                )
        if taken:
            node.get_logger().info(
                f'Started again in the same run, with what was set in it: {", ".join(taken)}.'
            )

    def keep(changes: list[Parameter]) -> None:
        new = {change.name: _plain(change.value) for change in changes if change.name in kept}
        if new:
            memory.parameters |= new
            save(node, ', '.join(new))

    node.add_post_set_parameters_callback(keep)


def _plain(value: Any) -> Any:
    return list(value) if isinstance(value, (array, tuple)) else value

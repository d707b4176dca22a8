"""A node with the standard lifecycle that starts by itself unless it is told not to."""

from __future__ import annotations

from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.parameter import Parameter

from likeme_core.ros import parameters
from likeme_core.ros.run_memory import memory_of, save
from likeme_core.settings import Setting

AUTOSTART = Setting(
    True,
    'Whether the node configures and activates itself; else by `ros2 lifecycle set`',
    read_only=True,
)


class ManagedNode(LifecycleNode):
    """A lifecycle node; parameter `autostart`.

    Attributes:
        active: whether it does its work.
    """

    def __init__(self, name: str, parameter_overrides: list[Parameter] | None = None) -> None:
        super().__init__(name, parameter_overrides=parameter_overrides)
        self.active = False
        parameters.declare(self, {'autostart': AUTOSTART})

    def autostart(self) -> None:
        """Configure and activate, if the parameter says so; the last line of `__init__`.

        A node that was deactivated, and is started again in the same run, is configured alone.
        """
        if not self.get_parameter('autostart').value:
            return
        self.trigger_configure()
        if memory_of(self).inactive:
            self.get_logger().warning('Not active, as before it was started again in this run.')
        else:
            self.trigger_activate()

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Begin to work."""
        self._keep(True)
        return super().on_activate(state)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Cease to work."""
        self._keep(False)
        return super().on_deactivate(state)

    def _keep(self, active: bool) -> None:
        self.active = active
        memory = memory_of(self)
        if memory.inactive == active:
            memory.inactive = not active
            save(self, f'That the node is {"" if active else "not "}active')

"""A node with the standard lifecycle that starts by itself unless it is told not to."""

from __future__ import annotations

from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.parameter import Parameter

from likeme_core.ros import parameters
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
        """Configure and activate, if the parameter says so; the last line of `__init__`."""
        if self.get_parameter('autostart').value:
            self.trigger_configure()
            self.trigger_activate()

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Begin to work."""
        self.active = True
        return super().on_activate(state)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Cease to work."""
        self.active = False
        return super().on_deactivate(state)

"""The world of a node: its parameter, and the topic that says what the numbers mean."""

from __future__ import annotations

import time

import rclpy
from rclpy.node import Node

from likeme_core.ros import parameters
from likeme_core.ros.qos import LATCHED
from likeme_core.settings import WORLD
from likeme_core.world import World, load_world
from likeme_msgs.msg import World as WorldMsg


def declare_world(node: Node) -> World:
    """Declare the parameter `world` and read what it names.

    Raises:
        ValueError: no such world, or its file is not valid.
    """
    parameters.declare(node, {'world': WORLD})
    return load_world(node.get_parameter('world').value)


class WorldPublisher:
    """Publishes the topic `world` (World, latched) once."""

    def __init__(self, node: Node, world: World) -> None:
        self._publisher = node.create_publisher(WorldMsg, 'world', LATCHED)
        self._publisher.publish(world_msg(world))


def world_msg(world: World) -> WorldMsg:
    """The message that says what the numbers of a world mean."""
    return WorldMsg(
        name=world.name,
        digest=world.digest,
        regions=[state.name for state in world.states],
        reachable=[entry.reachable for entry in world.region_entries],
        actions=[action.name for action in world.actions],
        manners=[action.manner.name.lower() for action in world.actions],
        targets=[int(action.target) for action in world.actions],
        objects=list(world.objects),
    )


class WorldNames:
    """The names behind the numbers in messages, from the topic `world`."""

    def __init__(self, world: WorldMsg | None) -> None:
        """world: None if nobody publishes it; numbers are then shown as they are."""
        self.message = world

    @property
    def states(self) -> tuple[str, ...]:
        """The names of all states; none before they are known."""
        return () if self.message is None else tuple(self.message.regions)

    def state(self, number: int) -> str:
        """The name of a state."""
        return self._name(list(self.states), number)

    def action(self, number: int) -> str:
        """The name of an action."""
        return self._name([] if self.message is None else list(self.message.actions), number)

    def check_state(self, name: str) -> None:
        """Refuse what is no state's name, in any case.

        Raises:
            ValueError: with the names.
        """
        if name.lower() not in [each.lower() for each in self.states]:
            names = ', '.join(each.lower() for each in self.states)
            raise ValueError(f'Expected one of {names}, got {name!r}.')

    def action_of(self, manner: str, target: str) -> str:
        """The name of the action of a manner and a target state.

        Raises:
            ValueError: no such state, or no such action.
        """
        self.check_state(target)
        assert self.message is not None, 'Without the message no state is known.'
        for action, how, number in zip(
            self.message.actions, self.message.manners, self.message.targets, strict=True
        ):
            if how == manner and self.state(number).lower() == target.lower():
                return str(action)
        raise ValueError(
            f'Expected an action of the world {self.message.name}, got none that moves by '
            f'{manner} to {target}.'
        )

    def _name(self, names: list[str], number: int) -> str:
        return names[number] if 0 <= number < len(names) else f'number {number}'


class WorldSubscriber:
    """Receives the topic `world`."""

    def __init__(self, node: Node) -> None:
        self._node, self._world = node, WorldNames(None)
        node.create_subscription(WorldMsg, 'world', self._on_world, LATCHED)

    def wait(self, timeout: float) -> WorldNames:
        """The names, after spinning until they are known or for `timeout` s."""
        deadline = time.monotonic() + timeout
        while self._world.message is None and time.monotonic() < deadline:
            rclpy.spin_once(self._node, timeout_sec=0.1)
        return self._world

    def _on_world(self, message: WorldMsg) -> None:
        self._world = WorldNames(message)

"""Options that all command lines share."""

from __future__ import annotations

import getpass
import os
from typing import Annotated, Any

import typer

from likeme_core.world import World, load_world
from likeme_core.world.file import DEFAULT_WORLD

#: 232 is the greatest domain ID for which DDS has ports.
Domain = Annotated[int, typer.Option(min=0, max=232, envvar='ROS_DOMAIN_ID', help='ROS domain.')]

#: Seeds are parameters of nodes, too: whole numbers of 64 bits.
MAX_SEED = 2**63 - 1

#: Of clients of a running cell.
Network = Annotated[
    bool, typer.Option('--network', help='Look for the cell on other machines of the subnet too.')
]


def set_discovery(network: bool) -> None:
    """Let this process find nodes on the subnet, if `network`; before rclpy is initialised."""
    if network:
        os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'SUBNET'


def user_name() -> str:
    """The user name, if the system knows it."""
    try:
        return getpass.getuser()
    except (KeyError, OSError):
        return 'operator'


def _read_world(value: str | World) -> World:
    """A world by its name or its file, for typer."""
    if isinstance(value, World):
        return value
    try:
        return load_world(value)
    except ValueError as error:
        raise typer.BadParameter(str(error)) from error


#: Default: typer.Option needs the text that stands for it.
WORLD_DEFAULT: Any = DEFAULT_WORLD
_WORLD = typer.Option(
    '--world', metavar='NAME|FILE', parser=_read_world, help='A shipped world or a world file.'
)
WorldOption = Annotated[World, _WORLD]
#: Without a default, for what may take its world from elsewhere.
OptionalWorld = Annotated[World | None, _WORLD]

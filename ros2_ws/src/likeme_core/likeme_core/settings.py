"""Node parameters as data: one table a node, from which ROS parameters are declared."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple


class Setting(NamedTuple):
    """A node parameter.

    Attributes:
        default: its value unless somebody sets it.
        description: what it means, with its unit.
        limits: least and greatest value of a number.
        read_only: whether it is read once, when the node starts.
    """

    default: Any
    description: str
    limits: tuple[float, float] | None = None
    read_only: bool = False


def defaults(settings: Mapping[str, Setting]) -> dict[str, Any]:
    """The default of every parameter by name."""
    return {name: setting.default for name, setting in settings.items()}

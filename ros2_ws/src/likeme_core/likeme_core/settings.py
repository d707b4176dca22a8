"""Tables of node parameters, from which ROS parameters are declared."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from likeme_core.world.file import DEFAULT_WORLD


class Setting(NamedTuple):
    """A node parameter.

    Attributes:
        default: value unless set; it also determines the type.
        description: meaning and unit.
        limits: least and greatest value of a number.
        read_only: whether it can be set only when the node starts.
        kept: whether what is set outlives the process within a run, see run_memory.
    """

    default: Any
    description: str
    limits: tuple[float, float] | None = None
    read_only: bool = False
    kept: bool = True


#: The parameter by which every node takes its world.
WORLD = Setting(
    DEFAULT_WORLD, "A shipped world's name, or the path of a world file.", read_only=True
)


def defaults(settings: Mapping[str, Setting]) -> dict[str, Any]:
    """The default of every parameter by name."""
    return {name: setting.default for name, setting in settings.items()}

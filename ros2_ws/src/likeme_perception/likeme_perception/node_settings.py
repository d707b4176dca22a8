"""Parameters of the perception node, and their conversion to a PerceptionConfig."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any, NamedTuple

from likeme_core.geometry import Rectangle
from likeme_core.settings import Setting
from likeme_core.world import World
from likeme_perception.catalogue import Catalogue, world_catalogue
from likeme_perception.config import PerceptionConfig, config_from, world_config

#: Description and limits of the fields of PerceptionConfig, in the order of their declaration.
_CONFIG: dict[str, tuple[str, tuple[float, float] | None]] = {
    'fallen_depth': ('a centroid this far below the table top is elsewhere, m', (0.005, 1.0)),
    'min_height': ('least height of an object above the table, m', (0.002, 0.1)),
    'height_sigmas': ('least height in standard deviations of the depth noise', (0.0, 20.0)),
    'cell_size': ('cell of the top-view grid, m', (0.001, 0.05)),
    'min_object_area': ('least visible area of an object, m^2', (1e-5, 0.1)),
    'max_object_length': (
        'greatest length of an object; a longer blob is a hand or an arm, m',
        (0.02, 2.0),
    ),
    'cut_off_length': (
        "greatest length of an object that the image's border cuts off, m",
        (0.02, 2.0),
    ),
    'visible_fraction': (
        "least visible share of an object's area to state its position",
        (0.05, 1.0),
    ),
    'min_identity': ('least probability to identify an object', (0.0, 1.0)),
    'centroid_sigma': (
        'standard deviation of the centroid of a fully visible object, m',
        (1e-4, 0.1),
    ),
    'rest_radius': ('an object is at rest if it stays within this radius, m', (1e-3, 0.1)),
    'settle_time': ('time within rest_radius after which an object is at rest, s', (0.0, 10.0)),
    'absence_time': ('time after which an object that is not seen is elsewhere, s', (0.0, 10.0)),
    'intruder_min_area': ('least area of a hand or an arm in view, m^2', (1e-5, 0.1)),
    'hand_gone_time': ('time out of view after which a hand has left, s', (0.0, 10.0)),
    'still_time': (
        'time without motion after which a hand or arm becomes background, s',
        (1.0, 3600.0),
    ),
    'settle_timeout': (
        'longest wait for objects to come to rest after a hand has left, s',
        (0.1, 60.0),
    ),
    'place_rise': ('rise at which PLACE and PUSH are equally likely, m', (0.005, 0.5)),
    'place_rise_scale': ('width of the transition from PUSH to PLACE, m', (1e-3, 0.1)),
    'camera_position': ("position of the camera's optical frame, m; empty: estimated", None),
    'camera_quaternion': ('orientation of that frame, x y z w', None),
    'table': ('table top: x_min x_max y_min y_max, m; empty: estimated', None),
    'table_colour': (
        "RGB of the bare table where the objects' looks were measured; empty: not known",
        None,
    ),
    'human_sides': ("sides over which a person's hand enters: near far left right", None),
    'robot_sides': ("sides over which the robot's arm enters", None),
    'background_frames': ('number of frames to learn the background from', (1, 1000)),
    'empty_at_start': ('whether the table is empty while the background is learned', None),
    'reference_frame': ('frame of all positions: x forward, y left, z up', None),
}
# Parameters whose empty list stands for None.
_OPTIONAL = ('camera_position', 'table', 'table_colour')


class NodeSettings(NamedTuple):
    """The values of all parameters; pairing_tolerance in s."""

    config: PerceptionConfig
    catalogue: Catalogue
    pairing_tolerance: float


def _default(name: str, config: PerceptionConfig) -> Any:
    """A parameter's default; rectangles as 4 numbers, None as an empty list."""
    value = getattr(config, name)
    if isinstance(value, Rectangle):
        return [value.x_min, value.x_max, value.y_min, value.y_max]
    if value is None:
        return []
    return list(value) if isinstance(value, tuple) else value


#: Parameters that describe the cell: their defaults are those of the world.
GEOMETRY = (
    'fallen_depth', 'camera_position', 'camera_quaternion', 'table', 'table_colour', 'human_sides',
    'robot_sides',
)  # fmt: skip


@cache
def settings_of(world: World) -> dict[str, Setting]:
    """The parameters of the node, with defaults for a world."""
    config = world_config(world)
    return {
        name: Setting(_default(name, config), description, limits)
        for name, (description, limits) in _CONFIG.items()
    } | {
        'pairing_tolerance': Setting(
            0.016, 'greatest difference of the stamps of a colour and a depth image, s', (0.0, 1.0)
        ),
    }


def read_settings(values: Mapping[str, Any], world: World) -> NodeSettings:
    """Settings from the values of all parameters.

    Raises:
        ValueError: a value is not valid.
    """
    given = {name: values[name] for name in settings_of(world)}
    tolerance = given.pop('pairing_tolerance')
    for name, value in given.items():
        if not isinstance(value, str | int | float):
            given[name] = tuple(value) or (None if name in _OPTIONAL else ())
    config = config_from(given, world_config(world))
    # Raises ValueError if the pose is not valid.
    config.camera_pose()
    return NodeSettings(config, world_catalogue(world), tolerance)

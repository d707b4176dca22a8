"""The perception node's parameters: names, defaults, ranges, and the values they stand for."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from likeme_core.geometry import Rectangle
from likeme_core.settings import Setting
from likeme_perception.config import PerceptionConfig, config_from
from likeme_perception.identification import Catalogue, load_catalogue

#: Description and limits of the fields of PerceptionConfig, in the order of their declaration.
_CONFIG: dict[str, tuple[str, tuple[float, float] | None]] = {
    'blue_line_y': ('LEFT is y greater than this, m', (-10.0, 10.0)),
    'fallen_depth': ('a centroid this far below the table top is OFFTABLE, m', (0.005, 1.0)),
    'min_height': ('least height of a thing over the table, m', (0.002, 0.1)),
    'height_sigmas': ('the same in standard deviations of the depth noise', (0.0, 20.0)),
    'cell_size': ('top-view cell that joins pixels to things, m', (0.001, 0.05)),
    'min_object_area': ('least seen area of a thing, m^2', (1e-5, 0.1)),
    'max_object_length': ('what is longer is a hand or an arm, m', (0.02, 2.0)),
    'cut_off_length': ("what the image's edge cuts off and is longer is a limb, m", (0.02, 2.0)),
    'visible_fraction': ("share of an object's area that must be seen to place it", (0.05, 1.0)),
    'min_identity': ('least probability to call pixels by a name', (0.0, 1.0)),
    'centroid_sigma': ("standard deviation of a fully seen object's centroid, m", (1e-4, 0.1)),
    'rest_radius': ('an object that stays within this is at rest, m', (1e-3, 0.1)),
    'settle_time': ('for this long, s', (0.0, 10.0)),
    'absence_time': ('an object that is not seen for this long is OFFTABLE, s', (0.0, 10.0)),
    'intruder_min_area': ('least area of a hand or an arm in view, m^2', (1e-5, 0.1)),
    'hand_gone_time': ('a hand that is out of view for this long has left, s', (0.0, 10.0)),
    'still_time': (
        'a hand or arm that is still for this long is background until it moves, s',
        (1.0, 3600.0),
    ),
    'settle_timeout': ('after a hand has left, wait this long for things to rest, s', (0.1, 60.0)),
    'place_rise': ('rise at which an object is as likely placed as pushed, m', (0.005, 0.5)),
    'place_rise_scale': ('width of that transition, m', (1e-3, 0.1)),
    'camera_position': ("position of the camera's optical frame, m; empty: estimated", None),
    'camera_quaternion': ('its orientation, x y z w', None),
    'table': ('table top: x_min x_max y_min y_max, m; empty: the plane as far as seen', None),
    'work_area': ('the part that is LEFT or RIGHT: x_min x_max y_min y_max, m; empty: all', None),
    'human_sides': ("sides of the table a person's hand comes in over: near far left right", None),
    'robot_sides': ("sides the robot's arm comes in over", None),
    'background_frames': ('frames to learn the background from', (1, 1000)),
    'empty_at_start': ('nothing stands on the table while the background is learned', None),
    'reference_frame': ('frame of all positions: x forward, y left, z up', None),
}
# What an empty list stands for None in.
_OPTIONAL = ('camera_position', 'table', 'work_area')


class NodeSettings(NamedTuple):
    """What the parameters stand for; pairing_tolerance in s."""

    config: PerceptionConfig
    catalogue: Catalogue
    pairing_tolerance: float


def _default(name: str) -> Any:
    """A parameter's default; rectangles as x_min, x_max, y_min, y_max, None as an empty list."""
    value = getattr(PerceptionConfig(), name)
    if isinstance(value, Rectangle):
        return [value.x_min, value.x_max, value.y_min, value.y_max]
    if value is None:
        return []
    return list(value) if isinstance(value, tuple) else value


SETTINGS: dict[str, Setting] = {
    name: Setting(_default(name), description, limits)
    for name, (description, limits) in _CONFIG.items()
} | {
    'catalogue_file': Setting('', "YAML of known objects; empty: the cell's toys"),
    'pairing_tolerance': Setting(
        0.016, 'greatest difference of the stamps of a colour and a depth image, s', (0.0, 1.0)
    ),
}


def read_settings(values: Mapping[str, Any]) -> NodeSettings:
    """Make settings of all parameters' values.

    Raises:
        ValueError, OSError: a value makes no sense, or the catalogue cannot be read.
    """
    given = {name: values[name] for name in SETTINGS}
    catalogue_file, tolerance = given.pop('catalogue_file'), given.pop('pairing_tolerance')
    for name, value in given.items():
        if not isinstance(value, str | int | float):
            given[name] = tuple(value) or (None if name in _OPTIONAL else ())
    config = config_from(given)
    # Refuses a pose that is none.
    config.camera_pose()
    path = Path(catalogue_file).expanduser() if catalogue_file else None
    return NodeSettings(config, load_catalogue(path), tolerance)

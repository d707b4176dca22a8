"""Configuration of perception: geometry of the cell, and thresholds."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, get_type_hints

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from likeme_core.geometry import Rectangle
from likeme_core.world import World, load_world
from likeme_perception.typed_values import (
    flag,
    number,
    numbers,
    text,
    texts,
    triple,
    whole_number,
)

SIDES = ('near', 'far', 'left', 'right')


@dataclass(frozen=True)
class PerceptionConfig:
    """Parameters of one set-up; m and s, in the reference frame (z = 0: table top)."""

    # Regions, manners and objects; None: on the table or not is all that is told.
    world: World | None = None
    reference_frame: str = 'base_link'
    # Pose of the camera's optical frame in the reference frame; None: estimated from the table
    # plane (origin where the optical axis meets the table, x towards the top of the image).
    camera_position: tuple[float, float, float] | None = None
    # x, y, z, w; turns the optical frame (z forward, x right, y down) into the reference frame.
    camera_quaternion: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)
    # The table top; None: estimated from the depth.
    table: Rectangle | None = None
    # An object whose centroid is this far below the table top is elsewhere.
    fallen_depth: float = 0.03
    # RGB of the bare table in the images that the catalogue's colours were measured in; None: not
    # known, then only changes of the light after the background was learned are compensated.
    table_colour: tuple[float, float, float] | None = None
    # Sides of the table, as seen by the robot, over which a person's hand and its own arm enter.
    human_sides: tuple[str, ...] = ('far',)
    robot_sides: tuple[str, ...] = ('near',)
    # Number of frames to learn the background from.
    background_frames: int = 30
    # True: the table is empty while the background is learned; what stands there is background.
    # False: objects may be on it from the start and are found above the table's plane.
    empty_at_start: bool = False
    # Least height of an object, in m and in deviations of the depth noise; the greater counts.
    min_height: float = 0.008
    height_sigmas: float = 4.0
    # Cell of the top-view grid; least area and greatest length of an object.
    cell_size: float = 0.006
    min_object_area: float = 0.0003
    max_object_length: float = 0.25
    # Greatest length of an object that the image's border cuts off.
    cut_off_length: float = 0.12
    # Least visible share of an object's usual area to state its position.
    visible_fraction: float = 0.15
    # Least probability to identify an object.
    min_identity: float = 0.3
    # Standard deviation of the centroid of a fully visible object.
    centroid_sigma: float = 0.003
    # An object is at rest if it stays within rest_radius for settle_time, and elsewhere if it is
    # not seen for absence_time.
    rest_radius: float = 0.008
    settle_time: float = 0.4
    absence_time: float = 0.3
    # Least area of a hand or an arm over the table; time out of view after which a hand has left.
    intruder_min_area: float = 0.0008
    hand_gone_time: float = 0.3
    # A hand or arm that does not move for this long is background until it moves.
    still_time: float = 20.0
    # Longest wait for objects to come to rest after a hand has left.
    settle_timeout: float = 5.0
    # Rise at which PLACE and PUSH are equally likely, and the width of that transition.
    place_rise: float = 0.035
    place_rise_scale: float = 0.008

    def __post_init__(self) -> None:
        for name in ('human_sides', 'robot_sides'):
            wrong = [side for side in getattr(self, name) if side not in SIDES]
            if wrong:
                raise ValueError(f'Expected {name} among {SIDES}, got {wrong[0]!r}.')
        for name in (
            'min_height',
            'cell_size',
            'rest_radius',
            'place_rise_scale',
            'centroid_sigma',
        ):
            if not getattr(self, name) > 0:
                raise ValueError(f'Expected {name} above 0, got {getattr(self, name):g}.')
        if self.background_frames < 1:
            raise ValueError(
                f'Expected background_frames of 1 or more, got {self.background_frames}.'
            )

    def camera_pose(self) -> NDArray[np.float64] | None:
        """4x4 transform from the optical to the reference frame, None when to be estimated."""
        if self.camera_position is None:
            return None
        return pose_matrix(self.camera_position, self.camera_quaternion)


def world_config(world: World) -> PerceptionConfig:
    """The parameters of a world: its geometry, and the default thresholds.

    The quaternion has 6 decimals, as it is given in node parameters.
    """
    quaternion = Rotation.from_matrix(world.camera.pose()[:3, :3]).as_quat()
    x, y, z, w = (round(float(q), 6) for q in quaternion)
    return PerceptionConfig(
        world=world,
        camera_position=world.camera.position,
        camera_quaternion=(x, y, z, w),
        table=world.table.top,
        table_colour=world.table.colour,
        fallen_depth=world.table.thickness,
        human_sides=world.person_sides,
        robot_sides=world.robot_sides,
    )


def pose_matrix(
    position: tuple[float, float, float], quaternion: tuple[float, float, float, float]
) -> NDArray[np.float64]:
    """4x4 transform from a position (m) and a unit quaternion x, y, z, w (within 1 %)."""
    if (len(position), len(quaternion)) != (3, 4):
        raise ValueError(
            f'Expected a position of 3 and a quaternion of 4 numbers, '
            f'got {len(position)} and {len(quaternion)}.'
        )
    length = float(np.linalg.norm(quaternion))
    if not abs(length - 1) < 0.01:
        raise ValueError(f'Expected a quaternion of length 1, got {length:g}.')
    x, y, z, w = np.asarray(quaternion, float) / length
    pose = np.eye(4)
    pose[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    pose[:3, 3] = position
    return pose


def config_from(
    values: Mapping[str, Any], base: PerceptionConfig | None = None
) -> PerceptionConfig:
    """A configuration with some values changed; rectangles as [x_min, x_max, y_min, y_max].

    base: what is not given; None: the default world's.
    """
    types = get_type_hints(PerceptionConfig)
    del types['world']
    unknown = sorted(set(values) - set(types))
    if unknown:
        raise ValueError(f'Expected settings among {sorted(types)}, got {unknown[0]!r}.')
    changes = {name: _READERS[types[name]](name, value) for name, value in values.items()}
    return replace(base or world_config(load_world()), **changes)


def _rectangle(name: str, value: Any) -> Rectangle | None:
    if value is None or isinstance(value, Rectangle):
        return value
    return Rectangle(*numbers(name, value, 4))


def _position(name: str, value: Any) -> tuple[float, float, float] | None:
    return None if value is None else triple(name, value)


#: How a value of each type of field is read.
_READERS: dict[Any, Callable[[str, Any], Any]] = {
    bool: flag,
    int: whole_number,
    float: number,
    str: text,
    tuple[str, ...]: texts,
    tuple[float, float, float] | None: _position,
    tuple[float, float, float, float]: partial(numbers, count=4),
    Rectangle | None: _rectangle,
}

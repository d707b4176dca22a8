"""Everything about the cell and the thresholds that another camera or table would change."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, get_type_hints

import numpy as np
from numpy.typing import NDArray

from likeme_perception.typed_values import (
    flag,
    number,
    numbers,
    read_text,
    text,
    texts,
    triple,
    whole_number,
    yaml_mapping,
)

SIDES = ('near', 'far', 'left', 'right')


@dataclass(frozen=True)
class Rectangle:
    """An axis-aligned area of the table plane, m, in the reference frame."""

    x_min: float
    x_max: float
    y_min: float
    y_max: float

    def __post_init__(self) -> None:
        if not (self.x_min < self.x_max and self.y_min < self.y_max):
            raise ValueError(
                f'Expected x_min < x_max and y_min < y_max, '
                f'got x {self.x_min:g} to {self.x_max:g} '
                f'and y {self.y_min:g} to {self.y_max:g}.'
            )

    def contains(
        self, x: NDArray[np.floating], y: NDArray[np.floating], margin: float = 0.0
    ) -> NDArray[np.bool_]:
        """Which points lie inside the rectangle grown by a margin (m) on every side."""
        return (
            (x >= self.x_min - margin)
            & (x <= self.x_max + margin)
            & (y >= self.y_min - margin)
            & (y <= self.y_max + margin)
        )

    def corners(self) -> NDArray[np.float64]:
        """The four corners in order round the area, (4, 2)."""
        x0, x1, y0, y1 = self.x_min, self.x_max, self.y_min, self.y_max
        return np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])


@dataclass(frozen=True)
class PerceptionConfig:
    """Numbers of one set-up; m and s, in the reference frame (z = 0: table top)."""

    reference_frame: str = 'base_link'
    # Pose of the camera's optical frame in the reference frame; None: estimated from the table
    # plane (origin where the optical axis meets the table, x towards the top of the image).
    camera_position: tuple[float, float, float] | None = (0.05, 0.38, 0.90)
    # x, y, z, w; turns the optical frame (z forward, x right, y down) into the reference frame.
    camera_quaternion: tuple[float, float, float, float] = (
        -0.651821,
        0.707065,
        -0.274097,
        0.007670,
    )
    # The table top, and the part of it that counts as LEFT or RIGHT. None: the plane as far as
    # seen.
    table: Rectangle | None = Rectangle(0.22, 0.66, -0.38, 0.38)
    work_area: Rectangle | None = Rectangle(0.27, 0.61, -0.33, 0.33)
    # LEFT is y > blue_line_y.
    blue_line_y: float = 0.0
    # Things whose centroid is this far below the table top have fallen off it.
    fallen_depth: float = 0.03
    # Sides of the table over which a person's hand and the robot's own arm come in, seen by the
    # robot.
    human_sides: tuple[str, ...] = ('far',)
    robot_sides: tuple[str, ...] = ('near',)
    # Background: frames to learn it from; least height of a thing, and the same in standard
    # deviations of the depth noise (the greater one counts).
    background_frames: int = 30
    # True: nothing stands on the table while the background is learned, so what rises there is
    # scene. False: things may stand there from the start and are found against the table's plane.
    empty_at_start: bool = False
    min_height: float = 0.008
    height_sigmas: float = 4.0
    # Objects: top-view cell that joins pixels, least area, largest length of one object.
    cell_size: float = 0.006
    min_object_area: float = 0.0003
    max_object_length: float = 0.25
    # What the image's edge cuts off and is still this long is no object.
    cut_off_length: float = 0.12
    # Share of an object's usual area that must be seen to state where it is.
    visible_fraction: float = 0.15
    # Identification: least probability to call pixels by a name.
    min_identity: float = 0.3
    # Standard deviation of a fully seen object's centroid.
    centroid_sigma: float = 0.003
    # At rest: stays within rest_radius for settle_time. Gone: not seen for absence_time.
    rest_radius: float = 0.008
    settle_time: float = 0.4
    absence_time: float = 0.3
    # Area over the table that makes a hand or an arm, and how long it must be out of view to have
    # left.
    intruder_min_area: float = 0.0008
    hand_gone_time: float = 0.3
    # A hand or arm that does not move for this long is a thing somebody put there: background,
    # until it moves.
    still_time: float = 20.0
    # After a hand has left, wait this long at most for things to come to rest.
    settle_timeout: float = 5.0
    # Rise at which a carried object is as likely placed as pushed, and the width of that
    # transition.
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


def pose_matrix(
    position: tuple[float, float, float], quaternion: tuple[float, float, float, float]
) -> NDArray[np.float64]:
    """4x4 transform from a position (m) and a quaternion x, y, z, w of length 1 within 1 %."""
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
    """A configuration with some numbers changed; rectangles as [x_min, x_max, y_min, y_max]."""
    types = get_type_hints(PerceptionConfig)
    unknown = sorted(set(values) - set(types))
    if unknown:
        raise ValueError(f'Expected settings among {sorted(types)}, got {unknown[0]!r}.')
    changes = {name: _READERS[types[name]](name, value) for name, value in values.items()}
    return replace(base or PerceptionConfig(), **changes)


def load_config(path: Path) -> PerceptionConfig:
    """Read a configuration from YAML that names only what differs from the cell's numbers."""
    config = config_from(yaml_mapping(read_text(path), path))
    # Refuses a pose that is none.
    config.camera_pose()
    return config


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

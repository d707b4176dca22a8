"""Learning an object from views: what it looks like, and a primitive of its size."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from likeme_perception.blobs import Index
from likeme_perception.camera_view import CameraView
from likeme_perception.catalogue import Catalogue, CatalogueObject, ObjectSample, catalogue_entry
from likeme_perception.config import PerceptionConfig
from likeme_perception.light import Rgb, as_taught, light_of
from likeme_perception.observation import TableObservation
from likeme_perception.pipeline import TabletopPerception
from likeme_perception.rgbd import Intrinsics, RgbdFrame
from likeme_perception.single_frame import look_at
from likeme_perception.top_view import Shape

#: Views from which an object is learned, at least.
MIN_VIEWS = 5
# A view is another one if the object has been turned (rad) or moved (m) by this much.
_TURNED, _MOVED = np.radians(15.0), 0.02
# The object rests if it stays within this (m) for so many frames.
_REST, _REST_FRAMES = 0.004, 6
# Height below the top (m) that counts as its top face; share of the surface from which it is flat.
_TOP, _FLAT = 0.008, 0.45
# kg/m^3 of a toy, and what the simulator's light leaves of a colour.
_DENSITY, _BRIGHTNESS = 400.0, 0.92


class TeachingError(ValueError):
    """A view shows nothing that can be learned: expected and got."""


class View(NamedTuple):
    """One view of an object.

    sample: for the catalogue; its colours are those under the taught light. footprint: sides of
    the smallest rectangle around it from above, m. flat: share of the surface at its top. table:
    RGB of the bare table; None: not seen.
    """

    sample: ObjectSample
    footprint: tuple[float, float]
    flat: float
    table: Rgb | None


def view_of_pair(
    frame: RgbdFrame, camera: Intrinsics, config: PerceptionConfig | None, colour: Rgb | None
) -> View:
    """The view in one frame of an object alone on the table.

    config: of the cell; None: the table is found in the image. colour: of the bare table where the
    other objects were taught; None: not known.

    Raises:
        ValueError: there is no table, or not one object on it.
    """
    config = config and replace(config, table_colour=None)
    table, perception = look_at(frame, camera, None, config)
    return _view(frame, table, perception, colour)


class ViewCollector:
    """Takes views from frames, in which a person turns the object between rests."""

    def __init__(self, config: PerceptionConfig, camera: Intrinsics, colour: Rgb | None) -> None:
        """The table has to be seen without hands first; colour: see view_of_pair."""
        self._perception = TabletopPerception(
            replace(config, background_frames=10, table_colour=None), camera, Catalogue(())
        )
        self._colour = colour
        self._recent: deque[Shape] = deque(maxlen=_REST_FRAMES)
        self.views: list[View] = []
        #: Why the last frame was no view; empty if it was one.
        self.waits_for = ''

    def add(self, frame: RgbdFrame) -> bool:
        """Look at a frame; whether it became a view.

        Raises:
            ValueError: there is no table where it is expected.
        """
        table = self._perception.process(frame)
        self.waits_for = self._obstacle(table)
        if self.waits_for:
            self._recent.clear()
            return False
        shape = table.unknown_objects[0].shape
        self._recent.append(shape)
        middle = np.array([s.centroid[:2] for s in self._recent])
        if len(middle) < _REST_FRAMES or np.ptp(middle, axis=0).max() > _REST:
            self.waits_for = 'the object to rest'
        elif any(_alike(shape, view.sample.shape) for view in self.views):
            self.waits_for = 'the object to be turned'
        else:
            self.views.append(_view(frame, table, self._perception, self._colour))
            return True
        return False

    def _obstacle(self, table: TableObservation) -> str:
        """Why nothing is told of an object; empty if one is alone on the table."""
        if not table.learned:
            return 'the table to be learned: hands away'
        if table.reason:
            return f'frames that can be read: {table.reason}'
        if table.hand_in_view or table.arm_in_view:
            return 'hands and arm to leave'
        if len(table.unknown_objects) != 1:
            return f'one object alone on the table; there are {len(table.unknown_objects)}'
        return ''


def _alike(one: Shape, other: Shape) -> bool:
    """Whether two shapes are of the same rest of an object."""
    turned = abs((one.yaw - other.yaw + np.pi / 2) % np.pi - np.pi / 2)
    moved = float(np.hypot(*np.subtract(one.centroid[:2], other.centroid[:2])))
    round_ = max(one.width / one.length, other.width / other.length) > 0.85
    return moved < _MOVED and (turned < _TURNED or round_)


def _view(
    frame: RgbdFrame, table: TableObservation, perception: TabletopPerception, colour: Rgb | None
) -> View:
    if table.reason:
        raise TeachingError(f'Expected a frame that can be read, got: {table.reason}.')
    if len(table.unknown_objects) != 1 or perception.background is None:
        raise TeachingError(
            'Expected one object alone on the table, its whole in view, '
            f'got {len(table.unknown_objects)} objects.'
        )
    bare = perception.bare_table_colour(frame)
    light = None if colour is None or bare is None else light_of(bare, colour)
    if light is not None and light.reason:
        raise TeachingError(f'Expected a frame that can be read, got: {light.reason}.')
    seen = frame if light is None else replace(frame, rgb=as_taught(frame.rgb, light))
    sample = perception.largest_unknown(seen, table)
    assert sample is not None
    footprint, flat = _form(frame, table.unknown_objects[0].pixels, perception.background.view)
    return View(sample, footprint, flat, bare)


def _form(frame: RgbdFrame, pixels: Index, view: CameraView) -> tuple[tuple[float, float], float]:
    """Sides of the smallest rectangle around an object from above, m; share of a flat top."""
    points = view.points(pixels, frame.depth.ravel()[pixels])
    top = float(np.percentile(points[:, 2], 98))
    _, sides, _ = cv2.minAreaRect(np.ascontiguousarray(points[points[:, 2] > top / 2, :2]))
    flat = float(np.mean(points[:, 2] > top - _TOP))
    return (float(max(sides)), float(min(sides))), flat


def check_views(views: Sequence[View]) -> None:
    """Refuse to learn from too few.

    Raises:
        TeachingError: expected and got.
    """
    if len(views) < MIN_VIEWS:
        raise TeachingError(
            f'Expected at least {MIN_VIEWS} views of the object, turned between them, '
            f'got {len(views)}.'
        )


def taught_object(name: str, views: Sequence[View]) -> CatalogueObject:
    """What an object looks like, for a world file."""
    return catalogue_entry(name, [view.sample for view in views])


def simulated_object(views: Sequence[View]) -> dict[str, Any]:
    """The entry `simulation` of a world file: a box or an ellipsoid of the measured size.

    Mass and friction are a guess: no camera sees them.
    """
    length, width = (float(np.median([v.footprint[k] for v in views])) for k in (0, 1))
    height = float(np.median([view.sample.shape.height for view in views]))
    colours = np.concatenate([view.sample.colours for view in views])
    colour = np.clip(np.median(colours, axis=0) / _BRIGHTNESS, 0, 255).astype(int).tolist()
    sides = [round(v, 3) for v in (length, width, height)]
    if float(np.median([view.flat for view in views])) > _FLAT:
        part, volume = {'box': sides}, length * width * height
    else:
        part = {'ellipsoid': [round(v / 2, 4) for v in (length, width, height)]}
        volume = np.pi / 6 * length * width * height
    return {
        'parts': [part | {'colour': colour}],
        'mass': round(float(np.clip(_DENSITY * volume, 0.02, 0.5)), 3),
        'friction': 0.5,
        'rolling_friction': 0.002,
        'restitution': 0.1,
    }


def bare_table(views: Sequence[View]) -> NDArray[np.float64] | None:
    """Mean RGB of the bare table; None: no view has it."""
    seen = [view.table for view in views if view.table is not None]
    return np.mean(seen, axis=0) if seen else None

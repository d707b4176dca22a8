"""Overlay: the observation drawn into the camera's image."""

from __future__ import annotations

from typing import cast

import cv2
import numpy as np
from numpy.typing import NDArray

from likeme_core.tabletop import State
from likeme_core.world import World
from likeme_core.world.values import PALETTE
from likeme_perception.blobs import Index, mask_of
from likeme_perception.camera_view import CameraView
from likeme_perception.observation import ObjectObservation, TableObservation
from likeme_perception.top_view import Shape
from likeme_perception.unknown_objects import UnknownObject

ImageB = NDArray[np.uint8]
Colour = tuple[int, int, int]
Pixels = NDArray[np.float64]

# Drawn at twice the camera's size, so that thin lines and small letters are legible.
SCALE = 2
_UNKNOWN: Colour = (205, 205, 205)
_HAND: Colour = (255, 221, 87)
_ARM: Colour = (186, 148, 255)
_REFUSED: Colour = (255, 120, 100)
_WHITE: Colour = (255, 255, 255)
_DARK: Colour = (24, 28, 36)
_FONT = cv2.FONT_HERSHEY_DUPLEX
# Sub-pixel positions for cv2: coordinates are in 1/16 pixel.
_SHIFT = 4


def state_colour(state: State | None, world: World | None) -> Colour:
    """The colour in which a state is drawn: that of the world file; grey if it is not known."""
    if state is None:
        return _UNKNOWN
    return PALETTE[state % len(PALETTE)] if world is None else world.region(state).colour


def draw(
    rgb: ImageB,
    table: TableObservation,
    view: CameraView,
    world: World | None = None,
    title: str = '',
) -> ImageB:
    """The RGB image at twice its size, with regions, hand, arm, objects and their states."""
    size = rgb.shape[1] * SCALE, rgb.shape[0] * SCALE
    large = cv2.resize(np.ascontiguousarray(rgb), size, interpolation=cv2.INTER_CUBIC)
    canvas = np.asarray(large, np.uint8)
    for pixels, colour in ((table.hand, _HAND), (table.arm, _ARM)):
        _tint(canvas, pixels, rgb.shape[:2], colour)
    if world is not None:
        _draw_regions(canvas, view, world)
    for each in table.unknown_objects:
        _draw_unknown_object(canvas, view, each, rgb.shape[:2])
    for seen in table.objects:
        if seen.visible and seen.shape is not None:
            _draw_object(canvas, view, seen, seen.shape, rgb.shape[:2], world)
    _draw_unseen(canvas, table, world)
    _draw_title(canvas, table, title)
    return canvas


def _tint(canvas: ImageB, pixels: Index, shape: tuple[int, ...], colour: Colour) -> None:
    """Tint some pixels (flat indices of the camera's image) and draw their outline."""
    if len(pixels) == 0:
        return
    mask = _large_mask(pixels, shape)
    blend = 0.62 * canvas[mask > 0].astype(np.float32) + 0.38 * np.array(colour, np.float32)
    canvas[mask > 0] = blend.astype(np.uint8)
    cv2.drawContours(canvas, _contours(mask), -1, colour, 2, cv2.LINE_AA)


def _large_mask(pixels: Index, shape: tuple[int, ...]) -> ImageB:
    mask = mask_of(pixels, (shape[0], shape[1])) * np.uint8(255)
    closed = cv2.morphologyEx(mask, cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8))
    size = shape[1] * SCALE, shape[0] * SCALE
    smooth = cv2.GaussianBlur(
        cv2.resize(closed, size, interpolation=cv2.INTER_LINEAR), (0, 0), 1.5
    )
    return np.asarray(np.asarray(smooth) > 127, np.uint8)


def _contours(mask: ImageB) -> list[NDArray[np.int32]]:
    found = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)[0]
    return [np.asarray(outline, np.int32) for outline in found]


def _pixels_of(view: CameraView, points: NDArray[np.float64]) -> NDArray[np.int32]:
    """Points (N, 2 or 3), m, as fixed-point positions (_SHIFT bits) on the large image."""
    if points.shape[1] == 2:
        points = np.column_stack([points, np.zeros(len(points))])
    pixel = (view.project(points) + 0.5) * SCALE - 0.5
    return cast(NDArray[np.int32], np.rint(np.clip(pixel, -4e3, 4e3) * 2**_SHIFT).astype(np.int32))


def _draw_regions(canvas: ImageB, view: CameraView, world: World) -> None:
    """Draw the edges of the areas, the painted lines of the table, and the regions' names."""
    areas = [(entry, entry.area) for entry in world.region_entries if entry.area is not None]
    for _, area in areas:
        _polyline(canvas, _pixels_of(view, area.corners()), _WHITE, 2, closed=True)
    inside = world.regions.work_area
    for line in world.table.lines:
        ends = np.clip(
            [line.start, line.end], (inside.x_min, inside.y_min), (inside.x_max, inside.y_max)
        )
        _polyline(canvas, _pixels_of(view, ends), line.colour, 3)
    for entry, area in areas:
        # At the far end, where objects seldom are, in the middle of what the area has there.
        top = area.bounds.x_max - 0.02
        spot = _pixels_of(view, np.array([[top, area.centre[1]]]))[0] >> _SHIFT
        at = int(spot[0]), int(spot[1])
        _text(canvas, entry.state.name, at, 0.75, entry.colour, centred=True)


def _polyline(
    canvas: ImageB, points: NDArray[np.int32], colour: Colour, width: int, closed: bool = False
) -> None:
    for stroke, extra in ((_DARK, 2), (colour, 0)):
        cv2.polylines(canvas, [points], closed, stroke, width + extra, cv2.LINE_AA, _SHIFT)


def _draw_object(
    canvas: ImageB,
    view: CameraView,
    seen: ObjectObservation,
    shape: Shape,
    size: tuple[int, ...],
    world: World | None,
) -> None:
    """Draw outline, major axis, centroid, and a label with name, state and probability."""
    colour = state_colour(seen.state, world)
    mask = _large_mask(seen.pixels, size)
    contours = _contours(mask)
    cv2.drawContours(canvas, contours, -1, _DARK, 5, cv2.LINE_AA)
    cv2.drawContours(canvas, contours, -1, colour, 3 if seen.settled else 2, cv2.LINE_AA)
    _draw_axis(canvas, view, shape, colour)
    sure = seen.identity_probability >= 0.995
    name = seen.name if sure else f'{seen.name} {100 * seen.identity_probability:.0f}%'
    label = f'{name}  {_states(seen, world)}'
    top = min((int(c[:, 0, 1].min()) for c in contours), default=40)
    middle = _pixels_of(view, np.array([shape.centroid]))[0] >> _SHIFT
    _label(canvas, label, (int(middle[0]), top - 22), colour)


def _states(seen: ObjectObservation, world: World | None) -> str:
    """The object's state with its probability, and others that are at least 1 % probable."""
    if seen.state is None:
        return seen.state_name
    ranked = sorted(enumerate(seen.state_probability), key=lambda each: -each[1])
    others = [] if world is None else [(world.states[k].name, p) for k, p in ranked[1:]]
    told = [(seen.state_name, max(seen.state_probability)), *(o for o in others if o[1] >= 0.01)]
    return '  '.join(f'{name} {100 * p:.0f}%' for name, p in told)


def _draw_axis(canvas: ImageB, view: CameraView, shape: Shape, colour: Colour) -> None:
    along = np.array([np.cos(shape.yaw), np.sin(shape.yaw), 0.0]) * shape.length / 2
    middle = np.array(shape.centroid)
    ends = _pixels_of(view, np.stack([middle - along, middle + along, middle]))
    _polyline(canvas, ends[:2], colour, 2)
    for radius, fill in ((6, _DARK), (4, _WHITE)):
        cv2.circle(
            canvas, tuple(map(int, ends[2])), radius << _SHIFT, fill, -1, cv2.LINE_AA, _SHIFT
        )


def _draw_unknown_object(
    canvas: ImageB, view: CameraView, found: UnknownObject, size: tuple[int, ...]
) -> None:
    """Draw an object that is not in the catalogue, or one of several of a kind."""
    colour = (120, 230, 140)
    contours = _contours(_large_mask(found.pixels, size))
    cv2.drawContours(canvas, contours, -1, _DARK, 4, cv2.LINE_AA)
    cv2.drawContours(canvas, contours, -1, colour, 2, cv2.LINE_AA)
    _draw_axis(canvas, view, found.shape, colour)
    middle = _pixels_of(view, np.array([found.shape.centroid]))[0] >> _SHIFT
    at = int(middle[0]), int(middle[1]) - 14
    _text(canvas, found.name.replace('_', ' '), at, 0.5, colour, centred=True)


def _draw_unseen(canvas: ImageB, table: TableObservation, world: World | None) -> None:
    """List the objects that are not visible in the lower left corner."""
    unseen = [] if table.reason else [o for o in table.objects if not o.visible]
    for k, o in enumerate(reversed(unseen)):
        why = 'not in view' if o.state is not None else o.reason or 'not seen yet'
        label = f'{o.name}  {o.state_name}, {why}'
        width = cv2.getTextSize(label, _FONT, 0.6, 1)[0][0]
        at = width // 2 + 26, canvas.shape[0] - 32 - 40 * k
        _label(canvas, label, at, state_colour(o.state, world))


def _draw_title(canvas: ImageB, table: TableObservation, title: str) -> None:
    """Draw the title, and whether hand or arm are in view or nothing is known, upper left."""
    if title:
        _text(canvas, title, (22, 44), 1.0, _WHITE)
    if table.reason:
        status = f'all states are UNKNOWN: {table.reason}'
        _text(canvas, status, (22, 80 if title else 44), 0.65, _REFUSED)
        return
    limbs = [n for n, seen in (('hand', table.hand_in_view), ('arm', table.arm_in_view)) if seen]
    status = ' and '.join(limbs) + ' in view' if limbs else 'settled' if table.settled else ''
    if status:
        _text(
            canvas, status, (22, 80 if title else 44), 0.65, _HAND if 'hand' in limbs else _WHITE
        )


def _text(
    canvas: ImageB,
    text: str,
    at: tuple[int, int],
    size: float,
    colour: Colour,
    centred: bool = False,
) -> None:
    """Draw text with a dark outline, legible on any background."""
    (width, height), _ = cv2.getTextSize(text, _FONT, size, 1)
    spot = (at[0] - width // 2, at[1] + height // 2) if centred else at
    cv2.putText(canvas, text, spot, _FONT, size, _DARK, 4, cv2.LINE_AA)
    cv2.putText(canvas, text, spot, _FONT, size, colour, 1, cv2.LINE_AA)


def _label(canvas: ImageB, text: str, middle: tuple[int, int], colour: Colour) -> None:
    """Draw a dark rounded label with a coloured border, moved inside the image."""
    (width, height), _ = cv2.getTextSize(text, _FONT, 0.6, 1)
    half, radius = width // 2 + 4, height // 2 + 8
    x = int(np.clip(middle[0], half + radius + 2, canvas.shape[1] - half - radius - 3))
    y = int(np.clip(middle[1], radius + 2, canvas.shape[0] - radius - 3))
    for border, fill in ((2, colour), (0, _DARK)):
        cv2.line(canvas, (x - half, y), (x + half, y), fill, 2 * (radius + border), cv2.LINE_AA)
    cv2.putText(
        canvas, text, (x - width // 2, y + height // 2), _FONT, 0.6, colour, 1, cv2.LINE_AA
    )

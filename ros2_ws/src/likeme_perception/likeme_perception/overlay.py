"""What was recognised, drawn into the camera's image."""

from __future__ import annotations

from typing import cast

import cv2
import numpy as np
from numpy.typing import NDArray

from likeme_core.regions import Regions
from likeme_core.tabletop import State
from likeme_perception.observation import ObjectObservation, TableObservation
from likeme_perception.segmentation import Index, Shape, mask_of
from likeme_perception.view import TableView

ImageB = NDArray[np.uint8]
Colour = tuple[int, int, int]
Pixels = NDArray[np.float64]

# Drawn at twice the camera's size: thin lines and small letters stay sharp.
SCALE = 2
STATE_COLOURS: dict[State | None, Colour] = {
    State.LEFT: (64, 196, 255),
    State.RIGHT: (255, 176, 59),
    State.OFFTABLE: (255, 105, 135),
    None: (205, 205, 205),
}
_HAND: Colour = (255, 221, 87)
_ARM: Colour = (186, 148, 255)
_WHITE: Colour = (255, 255, 255)
_INK: Colour = (24, 28, 36)
_FONT = cv2.FONT_HERSHEY_DUPLEX
# Sub-pixel positions for cv2: coordinates are in 1/16 pixel.
_SHIFT = 4


def draw(
    rgb: ImageB,
    table: TableObservation,
    view: TableView,
    regions: Regions | None = None,
    title: str = '',
) -> ImageB:
    """The image, twice the size, RGB, with work area, line, hand, arm, objects and states."""
    size = rgb.shape[1] * SCALE, rgb.shape[0] * SCALE
    large = cv2.resize(np.ascontiguousarray(rgb), size, interpolation=cv2.INTER_CUBIC)
    canvas = np.asarray(large, np.uint8)
    for pixels, colour in ((table.hand, _HAND), (table.arm, _ARM)):
        _tint(canvas, pixels, rgb.shape[:2], colour)
    if regions is not None:
        _draw_regions(canvas, view, regions)
    for pixels, shape in table.things:
        _draw_thing(canvas, view, pixels, shape, rgb.shape[:2])
    for seen in table.objects:
        if seen.visible and seen.shape is not None:
            _draw_object(canvas, view, seen, seen.shape, rgb.shape[:2])
    _draw_unseen(canvas, table)
    _draw_title(canvas, table, title)
    return canvas


def _tint(canvas: ImageB, pixels: Index, shape: tuple[int, ...], colour: Colour) -> None:
    """Colour some pixels (flat indices of the small image) and draw their outline."""
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


def _pixels_of(view: TableView, points: NDArray[np.float64]) -> NDArray[np.int32]:
    """Points (N, 2 or 3), m, as cv2 positions on the large image with _SHIFT fractional bits."""
    if points.shape[1] == 2:
        points = np.column_stack([points, np.zeros(len(points))])
    pixel = (view.project(points) + 0.5) * SCALE - 0.5
    return cast(NDArray[np.int32], np.rint(np.clip(pixel, -4e3, 4e3) * 2**_SHIFT).astype(np.int32))


def _draw_regions(canvas: ImageB, view: TableView, regions: Regions) -> None:
    """The work area's edge, the blue line and the names of its halves."""
    area = regions.work_area
    corners = _pixels_of(view, area.corners())
    _polyline(canvas, corners, _WHITE, 2, closed=True)
    if not area.y_min < regions.blue_line_y < area.y_max:
        return
    line = np.array([[area.x_min, regions.blue_line_y], [area.x_max, regions.blue_line_y]])
    _polyline(canvas, _pixels_of(view, line), (40, 110, 255), 3)
    top = area.x_max - 0.02
    for state, y in (
        (State.LEFT, (regions.blue_line_y + area.y_max) / 2),
        (State.RIGHT, (regions.blue_line_y + area.y_min) / 2),
    ):
        spot = _pixels_of(view, np.array([[top, y]]))[0] >> _SHIFT
        _text(
            canvas,
            state.name,
            (int(spot[0]), int(spot[1])),
            0.75,
            STATE_COLOURS[state],
            centred=True,
        )


def _polyline(
    canvas: ImageB, points: NDArray[np.int32], colour: Colour, width: int, closed: bool = False
) -> None:
    for ink, extra in ((_INK, 2), (colour, 0)):
        cv2.polylines(canvas, [points], closed, ink, width + extra, cv2.LINE_AA, _SHIFT)


def _draw_object(
    canvas: ImageB, view: TableView, seen: ObjectObservation, shape: Shape, size: tuple[int, ...]
) -> None:
    """Outline, major axis, centroid, and a label with name, state and its probability."""
    colour = STATE_COLOURS[seen.state]
    mask = _large_mask(seen.pixels, size)
    contours = _contours(mask)
    cv2.drawContours(canvas, contours, -1, _INK, 5, cv2.LINE_AA)
    cv2.drawContours(canvas, contours, -1, colour, 3 if seen.settled else 2, cv2.LINE_AA)
    _draw_axis(canvas, view, shape, colour)
    label = f'{seen.name}  {seen.state_name}'
    if seen.state is not None:
        label += f' {100 * max(seen.state_probability):.0f}%'
    top = min((int(c[:, 0, 1].min()) for c in contours), default=40)
    middle = _pixels_of(view, np.array([shape.centroid]))[0] >> _SHIFT
    _pill(canvas, label, (int(middle[0]), top - 22), colour)


def _draw_axis(canvas: ImageB, view: TableView, shape: Shape, colour: Colour) -> None:
    along = np.array([np.cos(shape.yaw), np.sin(shape.yaw), 0.0]) * shape.length / 2
    middle = np.array(shape.centroid)
    ends = _pixels_of(view, np.stack([middle - along, middle + along, middle]))
    _polyline(canvas, ends[:2], colour, 2)
    for radius, ink in ((6, _INK), (4, _WHITE)):
        cv2.circle(
            canvas, tuple(map(int, ends[2])), radius << _SHIFT, ink, -1, cv2.LINE_AA, _SHIFT
        )


def _draw_thing(
    canvas: ImageB, view: TableView, pixels: Index, shape: Shape, size: tuple[int, ...]
) -> None:
    """Something in no catalogue."""
    colour = (120, 230, 140)
    contours = _contours(_large_mask(pixels, size))
    cv2.drawContours(canvas, contours, -1, _INK, 4, cv2.LINE_AA)
    cv2.drawContours(canvas, contours, -1, colour, 2, cv2.LINE_AA)
    _draw_axis(canvas, view, shape, colour)
    middle = _pixels_of(view, np.array([shape.centroid]))[0] >> _SHIFT
    _text(canvas, 'thing', (int(middle[0]), int(middle[1]) - 14), 0.5, colour, centred=True)


def _draw_unseen(canvas: ImageB, table: TableObservation) -> None:
    """Objects out of sight, listed in the lower left corner."""
    unseen = [o for o in table.objects if not o.visible]
    for k, o in enumerate(reversed(unseen)):
        label = f'{o.name}  {"covered" if o.state is None else o.state.name}, not in view'
        width = cv2.getTextSize(label, _FONT, 0.6, 1)[0][0]
        _pill(
            canvas, label, (width // 2 + 26, canvas.shape[0] - 32 - 40 * k), STATE_COLOURS[o.state]
        )


def _draw_title(canvas: ImageB, table: TableObservation, title: str) -> None:
    """Title and what is in view, upper left."""
    if title:
        _text(canvas, title, (22, 44), 1.0, _WHITE)
    words = [w for w, there in (('hand', table.hand_in_view), ('arm', table.arm_in_view)) if there]
    status = ' and '.join(words) + ' in view' if words else 'settled' if table.settled else ''
    if status:
        _text(
            canvas, status, (22, 80 if title else 44), 0.65, _HAND if 'hand' in words else _WHITE
        )


def _text(
    canvas: ImageB,
    text: str,
    at: tuple[int, int],
    size: float,
    colour: Colour,
    centred: bool = False,
) -> None:
    """Letters with a dark rim, legible on any ground."""
    (width, height), _ = cv2.getTextSize(text, _FONT, size, 1)
    spot = (at[0] - width // 2, at[1] + height // 2) if centred else at
    cv2.putText(canvas, text, spot, _FONT, size, _INK, 4, cv2.LINE_AA)
    cv2.putText(canvas, text, spot, _FONT, size, colour, 1, cv2.LINE_AA)


def _pill(canvas: ImageB, text: str, middle: tuple[int, int], colour: Colour) -> None:
    """A rounded dark label with a coloured rim, kept inside the image."""
    (width, height), _ = cv2.getTextSize(text, _FONT, 0.6, 1)
    half, radius = width // 2 + 4, height // 2 + 8
    x = int(np.clip(middle[0], half + radius + 2, canvas.shape[1] - half - radius - 3))
    y = int(np.clip(middle[1], radius + 2, canvas.shape[0] - radius - 3))
    for grow, ink in ((2, colour), (0, _INK)):
        cv2.line(canvas, (x - half, y), (x + half, y), ink, 2 * (radius + grow), cv2.LINE_AA)
    cv2.putText(
        canvas, text, (x - width // 2, y + height // 2), _FONT, 0.6, colour, 1, cv2.LINE_AA
    )

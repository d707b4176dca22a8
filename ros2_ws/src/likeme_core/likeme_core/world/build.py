"""The values of a world file whose structure and content have been checked."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from likeme_core.camera_mount import CameraMount
from likeme_core.geometry import Area, Polygon, Rectangle
from likeme_core.table import DarkPlace, PaintedLine, Table
from likeme_core.tabletop import Action, Manner, State
from likeme_core.world.folder import WORLDS_FOLDER
from likeme_core.world.values import (
    PALETTE,
    Heading,
    ObjectEntry,
    PushTarget,
    RegionEntry,
    Span,
    StoryStep,
    World,
)

BLUE = (38, 92, 190)
#: Share of an area's half size within which objects are set down, so that their state does not
#: depend on which side of them the camera sees.
WELL_INSIDE = 0.5


def build_world(data: Mapping[str, Any], path: Path) -> World:
    """The world that checked data describe; path: of the file."""
    table = table_of(data['table'])
    states = {
        entry['name']: State(number, entry['name']) for number, entry in enumerate(data['regions'])
    }
    camera: dict[str, Any] = {
        key: tuple(map(float, value)) if isinstance(value, list) else value
        for key, value in data['camera'].items()
    }
    return World(
        name=data['name'],
        description=data.get('description', ''),
        source=path.stem if path.parent == WORLDS_FOLDER else str(path),
        folder=path.parent,
        table=table,
        camera=CameraMount(**camera),
        person_sides=tuple(data['sides']['person']),
        robot_sides=tuple(data['sides']['robot']),
        region_entries=tuple(
            _region(states[entry['name']], entry, table) for entry in data['regions']
        ),
        actions=tuple(
            Action(number, a['name'], Manner[a['manner'].upper()], states[a['target']])
            for number, a in enumerate(data['actions'])
        ),
        object_entries=tuple(
            ObjectEntry(
                o['name'],
                o['looks'],
                o.get('simulation'),
                states[o['start']] if 'start' in o else None,
            )
            for o in data['objects']
        ),
        story=tuple(
            StoryStep(
                step['object'],
                states[step['from']],
                states[step['to']],
                Manner[step.get('by', 'place').upper()],
            )
            for step in data.get('story', [])
        ),
    )


def table_of(data: Mapping[str, Any]) -> Table:
    """The table."""
    lines = tuple(
        PaintedLine(
            _pair(line['from']),
            _pair(line['to']),
            float(line.get('width', 0.012)),
            tuple(line.get('colour', BLUE)),
        )
        for line in data.get('lines', [])
    )
    thickness, floor = float(data.get('thickness', 0.03)), float(data.get('floor', -0.20))
    colour = _triple(data['colour']) if 'colour' in data else None
    dark = tuple(
        DarkPlace(_triple(place['at']), _triple(place['colour'])) for place in data.get('dark', [])
    )
    return Table(rectangle_of(data['top']), thickness, floor, lines, colour, dark)


def area_of(region: Mapping[str, Any]) -> Area | None:
    """The area of a region; None: elsewhere.

    Raises:
        ValueError: it is empty, or its sides cross.
    """
    if 'rectangle' in region:
        return rectangle_of(region['rectangle'])
    if 'polygon' in region:
        return Polygon(tuple(_pair(vertex) for vertex in region['polygon']))
    return None


def rectangle_of(data: Mapping[str, Any]) -> Rectangle:
    """A rectangle.

    Raises:
        ValueError: it is empty.
    """
    return Rectangle(*_pair(data['x']), *_pair(data['y']))


def _region(state: State, data: Mapping[str, Any], table: Table) -> RegionEntry:
    area = area_of(data)
    centre = _beyond_right_edge(table) if area is None else area.centre
    push = data.get('push', {})
    start = data.get('start')
    person = data.get('person')
    inside = _floor_at_right(table) if area is None else well_inside(area)
    span = None
    if person is None and area is not None:
        span = Span((inside.x_min, inside.x_max), (inside.y_min, inside.y_max))
    elif person is not None and 'y' in person:
        span = Span(_pair(person['x']), _pair(person['y']))
    return RegionEntry(
        state=state,
        area=area,
        reachable=data.get('reachable', area is not None),
        place=_pair(data['place']) if 'place' in data else centre,
        push=PushTarget(
            _pair(push['aim']) if 'aim' in push else centre,
            tuple(_heading(value) for value in push.get('headings', [])),
        ),
        start=inside if start is None else rectangle_of(start),
        person=span,
        person_x=_pair(person['x']) if person else (inside.x_min, inside.x_max),
        colour=tuple(data.get('colour', PALETTE[state % len(PALETTE)])),
    )


def well_inside(area: Area) -> Rectangle:
    """A rectangle around the centre in which an object's whole base lies in the area, if any."""
    x, y = area.centre
    bounds = area.bounds
    half_x, half_y = (
        WELL_INSIDE * min(x - bounds.x_min, bounds.x_max - x),
        WELL_INSIDE * min(y - bounds.y_min, bounds.y_max - y),
    )
    for _ in range(20):
        inner = Rectangle(x - half_x, x + half_x, y - half_y, y + half_y)
        if all(area.contains(float(a), float(b)) for a, b in inner.corners()):
            break
        half_x, half_y = 0.8 * half_x, 0.8 * half_y
    return inner


def _beyond_right_edge(table: Table) -> tuple[float, float]:
    return table.top.centre[0], table.top.y_min - 0.06


def _floor_at_right(table: Table) -> Rectangle:
    """Where the camera sees the floor past the table's right edge."""
    top = table.top
    x = top.centre[0]
    half = 0.35 * (top.x_max - top.x_min)
    return Rectangle(x - half, x + half, top.y_min - 0.32, top.y_min - 0.24)


def _heading(value: Any) -> Heading:
    if isinstance(value, list):
        length = math.hypot(*value)
        return Heading(value[0] / length, value[1] / length, math.atan2(value[1], value[0]))
    return Heading(math.cos(value), math.sin(value), float(value))


def _triple(values: Any) -> tuple[float, float, float]:
    first, second, third = map(float, values)
    return first, second, third


def _pair(value: Any) -> tuple[float, float]:
    first, second = value
    return float(first), float(second)

"""Problems of a world file's content that its schema cannot find."""

from __future__ import annotations

import itertools
import math
from collections.abc import Generator, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from likeme_core.geometry import Area, Rectangle, covers, overlap
from likeme_core.world.build import area_of, rectangle_of
from likeme_core.world.located_yaml import LocatedYaml, Problem
from likeme_core.world.values import UNKNOWN

#: Areas may share a border; numbers with a few digits do not meet exactly, m^2.
OVERLAP = 1e-9
#: Least size of an area: an object's base has to lie in it, m^2.
LEAST_AREA = 0.0009
Keys = tuple[str | int, ...]


def problems_of(located: LocatedYaml, folder: Path) -> list[Problem]:
    """What is wrong in data that fit the schema; folder: where meshes are looked for."""
    data = located.data
    found = [
        *_names(data),
        *_targets(data),
        *_geometry(data),
        *_cell(data),
        *_shapes(data, folder),
    ]
    return [Problem(located.line(keys), message) for keys, message in found]


def _names(data: Mapping[str, Any]) -> Iterator[tuple[Keys, str]]:
    """Names twice, names that stand for something else, and regions elsewhere."""
    for kind in ('regions', 'actions', 'objects'):
        seen: dict[str, str] = {}
        for index, entry in enumerate(data[kind]):
            name = entry['name']
            if name.lower() in seen:
                yield (
                    (kind, index, 'name'),
                    f"Expected {kind} with different names, got '{name}' after "
                    f"'{seen[name.lower()]}'.",
                )
            seen.setdefault(name.lower(), name)
    for index, region in enumerate(data['regions']):
        if region['name'].upper() == UNKNOWN:
            yield (
                ('regions', index, 'name'),
                f'Expected a name other than {UNKNOWN}, which means not known, '
                f"got '{region['name']}'.",
            )
    elsewhere = [index for index, region in enumerate(data['regions']) if 'elsewhere' in region]
    if len(elsewhere) != 1:
        keys: Keys = ('regions', elsewhere[1], 'elsewhere') if elsewhere else ('regions',)
        yield keys, f'Expected exactly one region with elsewhere: true, got {len(elsewhere)}.'

    if not any(region.get('reachable', 'elsewhere' not in region) for region in data['regions']):
        yield ('regions',), 'Expected a region that the robot reaches into, got none.'


def _targets(data: Mapping[str, Any]) -> Iterator[tuple[Keys, str]]:
    """References to regions that are not there, and actions that mean the same."""
    regions = [region['name'] for region in data['regions']]
    for kind, key in (('actions', 'target'), ('objects', 'start')):
        for index, entry in enumerate(data[kind]):
            if key in entry and entry[key] not in regions:
                yield (
                    (kind, index, key),
                    f"Expected {key} as one of {', '.join(regions)}, got '{entry[key]}'.",
                )
    yield from _story(data)
    seen: dict[tuple[str, str], str] = {}
    for index, action in enumerate(data['actions']):
        meaning = action['manner'], action['target']
        if meaning in seen:
            yield (
                ('actions', index),
                f'Expected actions that differ, got {action["manner"]} to {action["target"]} '
                f"as '{seen[meaning]}' and as '{action['name']}'.",
            )
        seen.setdefault(meaning, action['name'])


def _story(data: Mapping[str, Any]) -> Iterator[tuple[Keys, str]]:
    """Steps with unknown objects, without a change, or by an action that the world lacks."""
    objects = [entry['name'] for entry in data['objects']]
    reached = {r['name']: r.get('reachable', 'elsewhere' not in r) for r in data['regions']}
    actions = {(action['manner'], action['target']) for action in data['actions']}
    for index, step in enumerate(data.get('story', [])):
        known: tuple[tuple[str, Iterable[str]], ...] = (
            ('object', objects), ('from', reached), ('to', reached),
        )  # fmt: skip
        wrong = [(key, names) for key, names in known if step[key] not in names]
        for key, names in wrong:
            yield (
                ('story', index, key),
                f"Expected {key} as one of {', '.join(names)}, got '{step[key]}'.",
            )
        if wrong:
            continue
        manner = step.get('by', 'place')
        if step['from'] == step['to'] or not reached[step['from']]:
            yield (
                ('story', index),
                f'Expected a change from a region that the robot reaches into, '
                f'got {step["from"]} to {step["to"]}.',
            )
        elif (manner, step['to']) not in actions:
            yield (
                ('story', index),
                f'Expected a step by one of the actions, got {manner} to {step["to"]}.',
            )


def _geometry(data: Mapping[str, Any]) -> Iterator[tuple[Keys, str]]:
    """Areas that are empty, overlap, or lie off the table, and points far from all of it."""
    top = yield from _rectangle(('table', 'top'), data['table']['top'])
    areas: list[tuple[int, Area]] = []
    for index, region in enumerate(data['regions']):
        if 'start' in region:
            yield from _rectangle(('regions', index, 'start'), region['start'])
        yield from _headings(index, region)
        shape = next((key for key in ('rectangle', 'polygon') if key in region), None)
        if shape is None:
            continue
        try:
            area = area_of(region)
        except ValueError as error:
            yield ('regions', index, shape), str(error)
            continue
        assert area is not None, 'Only elsewhere has none.'
        areas.append((index, area))
        yield from _placed(index, region, area, top)
    for (_, first), (index, second) in itertools.combinations(areas, 2):
        if (shared := overlap(first, second)) > OVERLAP:
            name = data['regions'][index]['name']
            yield (
                ('regions', index),
                f'Expected areas that do not overlap, got {name} and another sharing '
                f'{shared * 1e4:.3g} cm^2.',
            )


def _placed(
    index: int, region: Mapping[str, Any], area: Area, top: Rectangle | None
) -> Iterator[tuple[Keys, str]]:
    """Whether an area is on the table, and the places of a region in its area."""
    name = region['name']
    size = area.bounds
    if (size.x_max - size.x_min) * (size.y_max - size.y_min) < LEAST_AREA:
        yield ('regions', index), f'Expected {name} of 3 cm by 3 cm or more, got less.'
        return
    if top is not None and not covers(top, area):
        yield (
            ('regions', index),
            f'Expected {name} on the table top, x {top.x_min:g} to {top.x_max:g} and '
            f'y {top.y_min:g} to {top.y_max:g}, got x {size.x_min:g} to {size.x_max:g} and '
            f'y {size.y_min:g} to {size.y_max:g}.',
        )
    points = {('place',): region.get('place'), ('push', 'aim'): region.get('push', {}).get('aim')}
    for keys, point in points.items():
        if point is not None and not area.contains(float(point[0]), float(point[1])):
            yield (
                ('regions', index, *keys),
                f'Expected {keys[-1]} of {name} in its area, got x {point[0]:g}, y {point[1]:g}.',
            )
    for key in ('start', 'person'):
        span = region.get(key)
        if span is None or 'y' not in span:
            continue
        corners = itertools.product(span['x'], span['y'])
        if not all(area.contains(float(x), float(y)) for x, y in corners):
            yield (
                ('regions', index, key),
                (f'Expected {key} of {name} within its area, got x {span["x"]}, y {span["y"]}.'),
            )


def _headings(index: int, region: Mapping[str, Any]) -> Iterator[tuple[Keys, str]]:
    for number, heading in enumerate(region.get('push', {}).get('headings', [])):
        if isinstance(heading, list) and abs(math.hypot(*heading) - 1.0) > 0.01:
            yield (
                ('regions', index, 'push', 'headings', number),
                f'Expected a direction of length 1, got {math.hypot(*heading):.3g}.',
            )


def _rectangle(
    keys: Keys, data: Mapping[str, Any]
) -> Generator[tuple[Keys, str], None, Rectangle | None]:
    try:
        return rectangle_of(data)
    except ValueError as error:
        yield keys, str(error)
    return None


def _cell(data: Mapping[str, Any]) -> Iterator[tuple[Keys, str]]:
    """A camera that does not look down at the table, and sides that cannot be told apart."""
    camera = data['camera']
    eye, target = camera['position'], camera['target']
    if eye[2] <= target[2]:
        yield (
            ('camera', 'position'),
            f'Expected a camera above its target, got heights {eye[2]:g} and {target[2]:g}.',
        )
    shared = sorted(set(data['sides']['person']) & set(data['sides']['robot']))
    if shared:
        yield (
            ('sides', 'robot'),
            f"Expected person and robot on different sides, got both at '{shared[0]}'.",
        )


def _shapes(data: Mapping[str, Any], folder: Path) -> Iterator[tuple[Keys, str]]:
    """Mesh files that are not there, and numbers out of their order."""
    for index, entry in enumerate(data['objects']):
        looks = entry['looks']
        if sum(part['weight'] for part in looks['colour']) <= 0:
            yield (
                ('objects', index, 'looks', 'colour'),
                f'Expected colour weights of {entry["name"]} with a sum above 0, got 0.',
            )
        for number, part in enumerate(entry.get('simulation', {}).get('parts', [])):
            if 'mesh' in part and not (folder / part['mesh']).is_file():
                yield (
                    ('objects', index, 'simulation', 'parts', number, 'mesh'),
                    f"Expected a mesh file beside the world file, got '{part['mesh']}'.",
                )

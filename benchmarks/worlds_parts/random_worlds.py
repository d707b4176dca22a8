"""Random valid worlds, and ways to break them."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np

LOOKS: dict[str, Any] = {
    'colour': [{'weight': 1.0, 'mean': [60.0, -20.0, 50.0], 'deviation': [3.0, 3.0, 3.0]}],
    'length': 0.07,
    'width': 0.05,
    'height': 0.05,
    'area': 0.003,
}
#: CIELAB colours that differ from each other, from skin, beech and the arm.
COLOURS = (
    (60.8, -30.0, 50.0),
    (73.2, -4.1, 75.0),
    (40.0, 45.0, 30.0),
    (45.0, 10.0, -50.0),
    (55.0, 60.0, -35.0),
    (65.0, -45.0, 5.0),
    (30.0, 5.0, 5.0),
)
SHAPES: tuple[dict[str, Any], ...] = (
    {'box': [0.05, 0.05, 0.05]},
    {'ellipsoid': [0.032, 0.024, 0.024]},
    {'capsule': {'from': [-0.02, 0.0, 0.0], 'to': [0.02, 0.0, 0.0], 'radius': 0.02}},
    {'lathe': [[-0.03, 0.0], [-0.02, 0.02], [0.02, 0.02], [0.03, 0.0]]},
)
TOP = {'x': [0.22, 0.66], 'y': [-0.38, 0.38]}


def random_world(seed: int) -> dict[str, Any]:
    """The data of a valid world: 2 to 6 regions, 1 to 7 objects, 2 to 18 actions."""
    rng = np.random.default_rng(seed)
    regions = _regions(int(rng.integers(2, 7)), rng)
    return {
        'world': 1,
        'name': f'random_{seed}',
        'table': {'top': TOP},
        'camera': {'position': [0.05, 0.38, 0.90], 'target': [0.44, -0.02, 0.0]},
        'sides': {'person': ['far'], 'robot': ['near']},
        'regions': regions,
        'actions': _actions([region['name'] for region in regions], rng),
        'objects': _objects(int(rng.integers(1, 8)), [r['name'] for r in regions], rng),
    }


def _regions(count: int, rng: np.random.Generator) -> list[dict[str, Any]]:
    """Side by side along y, each a rectangle or a polygon within one; the last is elsewhere."""
    borders = np.linspace(-0.34, 0.34, count)
    regions: list[dict[str, Any]] = []
    for number in range(count - 1):
        low, high = round(float(borders[number]), 4), round(float(borders[number + 1]), 4)
        region: dict[str, Any] = {'name': f'BIN_{number}'}
        if rng.random() < 0.4:
            cut = round((high - low) / 4, 4)
            region['polygon'] = [
                [0.28, low], [0.28, high], [0.50, high], [0.60, high - cut], [0.60, low + cut],
                [0.50, low],
            ]  # fmt: skip
        else:
            region['rectangle'] = {'x': [0.28, 0.60], 'y': [low, high]}
        regions.append(region)
    regions.append({'name': 'AWAY', 'elsewhere': True})
    order = rng.permutation(count)
    return [regions[i] for i in order]


def _actions(targets: list[str], rng: np.random.Generator) -> list[dict[str, str]]:
    every = [
        {'name': f'{manner}_{target}', 'manner': manner, 'target': target}
        for manner in ('place', 'push', 'drop')
        for target in targets
    ]
    count = int(rng.integers(2, len(every) + 1))
    return [every[i] for i in sorted(rng.permutation(len(every))[:count])]


def _objects(count: int, states: list[str], rng: np.random.Generator) -> list[dict[str, Any]]:
    objects = []
    for number in range(count):
        looks = copy.deepcopy(LOOKS)
        looks['colour'][0]['mean'] = list(COLOURS[number])
        part = dict(SHAPES[int(rng.integers(len(SHAPES)))])
        objects.append(
            {
                'name': f'thing_{number}',
                'start': states[int(rng.integers(len(states)))],
                'looks': looks,
                'simulation': {
                    'parts': [{**part, 'colour': [int(c) for c in rng.integers(30, 220, 3)]}],
                    'mass': 0.06,
                    'friction': 0.5,
                },
            }
        )
    return objects


def broken(world: dict[str, Any], rng: np.random.Generator) -> tuple[dict[str, Any], str]:
    """A world with one fault, and the kind of fault."""
    data = copy.deepcopy(world)
    faults = [
        _drop_key, _wrong_type, _unknown_key, _bad_number, _bad_target, _twice, _empty_area,
        _overlap, _off_table, _two_elsewhere, _no_elsewhere, _no_mesh, _bad_side, _same_action,
    ]  # fmt: skip
    fault = faults[int(rng.integers(len(faults)))]
    fault(data, rng)
    return data, fault.__name__.strip('_')


def _any_region(data: dict[str, Any], rng: np.random.Generator) -> dict[str, Any]:
    areas = [r for r in data['regions'] if 'elsewhere' not in r]
    region: dict[str, Any] = areas[int(rng.integers(len(areas)))]
    return region


def _drop_key(data: dict[str, Any], rng: np.random.Generator) -> None:
    places = [
        (data, ['world', 'name', 'table', 'camera', 'sides', 'regions', 'actions', 'objects']),
        (data['objects'][0], ['name', 'looks']),
        (data['objects'][0]['looks'], ['colour', 'length', 'width', 'height', 'area']),
        (data['actions'][0], ['name', 'manner', 'target']),
        (data['regions'][0], ['name']),
        (data['camera'], ['position', 'target']),
    ]
    place, keys = places[int(rng.integers(len(places)))]
    del place[keys[int(rng.integers(len(keys)))]]


def _wrong_type(data: dict[str, Any], rng: np.random.Generator) -> None:
    wrong = ['many', 3.5, True, [1], {'a': 1}, None][int(rng.integers(6))]
    if rng.random() < 0.5:
        data['regions'][0]['name'] = wrong if not isinstance(wrong, str) else 17
    else:
        data['camera']['position'] = wrong


def _unknown_key(data: dict[str, Any], rng: np.random.Generator) -> None:
    place = [data, data['regions'][0], data['table'], data['objects'][0]][int(rng.integers(4))]
    place['colur'] = 1


def _bad_number(data: dict[str, Any], rng: np.random.Generator) -> None:
    value = [-1.0, 0, float('nan'), float('inf'), 1e9][int(rng.integers(5))]
    data['objects'][-1]['looks'][['length', 'area'][int(rng.integers(2))]] = value


def _bad_target(data: dict[str, Any], rng: np.random.Generator) -> None:
    data['actions'][int(rng.integers(len(data['actions'])))]['target'] = 'NOWHERE'


def _twice(data: dict[str, Any], rng: np.random.Generator) -> None:
    kind = ['regions', 'actions'][int(rng.integers(2))]
    data[kind][1]['name'] = data[kind][0]['name'].lower()


def _empty_area(data: dict[str, Any], rng: np.random.Generator) -> None:
    region = _any_region(data, rng)
    region.pop('polygon', None)
    region['rectangle'] = {'x': [0.5, 0.3], 'y': [0.0, 0.1]}


def _overlap(data: dict[str, Any], rng: np.random.Generator) -> None:
    area = {'x': [0.30, 0.40], 'y': [-0.30, 0.30]}
    data['regions'].append({'name': 'EXTRA', 'rectangle': area})


def _off_table(data: dict[str, Any], rng: np.random.Generator) -> None:
    data['regions'].append({'name': 'EXTRA', 'rectangle': {'x': [0.7, 0.9], 'y': [0.0, 0.1]}})


def _two_elsewhere(data: dict[str, Any], rng: np.random.Generator) -> None:
    data['regions'].append({'name': 'EXTRA', 'elsewhere': True})


def _no_elsewhere(data: dict[str, Any], rng: np.random.Generator) -> None:
    entry = next(r for r in data['regions'] if 'elsewhere' in r)
    del entry['elsewhere']
    entry['rectangle'] = {'x': [0.22, 0.26], 'y': [-0.2, 0.2]}


def _no_mesh(data: dict[str, Any], rng: np.random.Generator) -> None:
    data['objects'][0]['simulation']['parts'] = [{'mesh': 'nowhere.ply'}]


def _bad_side(data: dict[str, Any], rng: np.random.Generator) -> None:
    data['sides']['robot'] = [['far'], ['up'], []][int(rng.integers(3))]


def _same_action(data: dict[str, Any], rng: np.random.Generator) -> None:
    first = data['actions'][0]
    data['actions'][1] = {**first, 'name': 'ANOTHER'}

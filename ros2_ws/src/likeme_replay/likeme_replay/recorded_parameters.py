"""Parameters that a bag was recorded with, and those of a parameter file."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from likeme_core.world import load_world
from likeme_core.world.file import DEFAULT_WORLD
from likeme_core.yaml_files import read_yaml

#: Key of a bag's custom data that holds the nodes' parameters, as JSON.
KEY = 'likeme.parameters'
#: Key of the label of the world that the recorded nodes ran in.
WORLD_KEY = 'likeme.world'
#: Parameters of perception that older releases recorded, and their defaults.
RETIRED: dict[str, Any] = {
    'blue_line_y': 0.0,
    'work_area': [0.27, 0.61, -0.33, 0.33],
    'catalogue_file': '',
}
NODES = ('perception_node', 'inference_node')
#: Parameters that a replay sets itself.
IGNORED = ('qos_overrides', 'replayed', 'use_sim_time', 'start_type_description_service')

Parameters = dict[str, dict[str, Any]]


def recorded(custom: Mapping[str, str]) -> Parameters:
    """The parameters a bag was recorded with; empty when it holds none.

    Raises:
        ValueError: they are malformed.
    """
    try:
        found = json.loads(custom.get(KEY, '{}'))
    except json.JSONDecodeError as error:
        raise ValueError(f'Expected JSON under {KEY} in metadata.yaml, got: {error}.') from None
    if not isinstance(found, dict) or not all(isinstance(v, dict) for v in found.values()):
        raise ValueError(f'Expected node: name: value under {KEY} in metadata.yaml.')
    _check_retired(found.get('perception_node', {}))
    return {node: _without_ignored(found[node]) for node in NODES if node in found}


def recorded_label(custom: Mapping[str, str]) -> str | None:
    """The label of the world a bag was recorded in, see World.label; None: not recorded."""
    return custom.get(WORLD_KEY)


def world_of(*nodes: Mapping[str, Any]) -> str:
    """The world that parameters of several nodes name; the default one if none does.

    Raises:
        ValueError: they name different ones.
    """
    named = {str(values['world']) for values in nodes if 'world' in values}
    if len(named) > 1:
        raise ValueError(f'Expected one world for all nodes, got {" and ".join(sorted(named))}.')
    return named.pop() if named else DEFAULT_WORLD


def in_world(parameters: Parameters, world: str) -> Parameters:
    """The same parameters with another world for every node."""
    return {node: parameters.get(node, {}) | {'world': world} for node in NODES}


def check_world(custom: Mapping[str, str], parameters: Parameters) -> None:
    """Refuse to replay a bag in another world than that of its recording.

    Raises:
        ValueError: with both worlds' names and digests.
    """
    label = recorded_label(custom)
    world = load_world(world_of(*parameters.values()))
    if label is not None and label != world.label:
        raise ValueError(
            f'Expected the world {label}, in which the bag was recorded, got {world.label}: '
            'name its file by --world.'
        )


def _check_retired(values: Mapping[str, Any]) -> None:
    """Refuse what an older release took as a parameter and a world file says now."""
    for name, expected in RETIRED.items():
        if values.get(name, expected) != expected:
            raise ValueError(
                f'Expected {name} {expected}, as in the world {DEFAULT_WORLD}, got '
                f'{values[name]}: describe the table in a world file and name it by --world.'
            )


def from_file(path: Path) -> Parameters:
    """The parameters in a ROS parameter file.

    Raises:
        ValueError: it cannot be read, or is malformed.
    """
    nodes = read_yaml(path)
    laid_out = isinstance(nodes, dict) and all(
        isinstance(node, dict) and isinstance(node.get('ros__parameters'), dict)
        for node in nodes.values()
    )
    if not laid_out:
        raise ValueError(f'Expected node: ros__parameters: name: value in {path}.')
    found = {name.lstrip('/'): node['ros__parameters'] for name, node in nodes.items()}
    return {node: _without_ignored(found[node]) for node in NODES if node in found}


def merged(first: Parameters, second: Parameters) -> Parameters:
    """`first`, overridden by `second`."""
    nodes = [node for node in NODES if node in first or node in second]
    return {node: first.get(node, {}) | second.get(node, {}) for node in nodes}


def _without_ignored(values: Mapping[str, Any]) -> dict[str, Any]:
    return {n: v for n, v in values.items() if n.partition('.')[0] not in IGNORED}

"""Parameters that a bag was recorded with, and those of a parameter file."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from likeme_core.yaml_files import read_yaml

#: Key of a bag's custom data that holds the nodes' parameters, as JSON.
KEY = 'likeme.parameters'
NODES = ('perception_node', 'inference_node')
#: Parameters that a replay sets itself.
IGNORED = ('replayed', 'use_sim_time', 'start_type_description_service')

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
    return {node: _without_ignored(found[node]) for node in NODES if node in found}


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

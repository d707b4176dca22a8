"""What the launch file starts, as JSON: its Python need not have what this package imports."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import yaml

from likeme_bringup.respawn import Respawn


class PlannedNode(NamedTuple):
    """A node to start.

    parameters: those that override the parameter files.
    """

    part: str
    name: str
    package: str
    executable: str
    parameters: Mapping[str, object]


def launch_plan(
    nodes: Sequence[PlannedNode], files: Sequence[Path], namespace: str, simulated_clock: bool
) -> str:
    """The nodes, the texts of their parameter files, the last one counts, and when to give up.

    namespace: of all nodes; empty: none. simulated_clock: see StartOptions.
    """
    clock = {'/**': {'ros__parameters': {'use_sim_time': True}}}
    own = {
        full_name(node.name, namespace): {'ros__parameters': dict(node.parameters)}
        for node in nodes
        if node.parameters
    }
    texts = [yaml.safe_dump(clock)] if simulated_clock else []
    texts += [in_namespace(path, namespace) for path in files]
    policy = Respawn()
    return json.dumps(
        {
            'nodes': [[node.part, node.package, node.executable] for node in nodes],
            'parameter_files': [*texts, yaml.safe_dump(own)] if own else texts,
            'pauses': len(policy.pauses),
            'stable': policy.stable,
        }
    )


def in_namespace(path: Path, namespace: str) -> str:
    """A parameter file whose nodes without a namespace are of this one.

    Only the nodes' names change: values stay as they are written, since ROS reads some in another
    way than PyYAML (1e-5).
    """
    root = yaml.compose(path.read_text(encoding='utf-8'))
    assert isinstance(root, yaml.MappingNode), 'validated() lets nothing else pass.'
    for key, _ in root.value:
        key.value = full_name(key.value, namespace)
    return str(yaml.serialize(root))


def full_name(node: str, namespace: str) -> str:
    """A node's name with its namespace; unchanged if it has one."""
    inside = namespace.strip('/')
    if node.startswith('/'):
        return node
    return f'/{inside}/{node}' if inside else f'/{node}'

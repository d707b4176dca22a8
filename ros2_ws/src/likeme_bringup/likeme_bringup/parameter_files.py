"""Validates ROS parameter files against the parameters that the cell's nodes declare."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from ament_index_python.packages import get_package_share_directory

from likeme_core.yaml_files import read_yaml

# Parameters of every node.
COMMON = ('use_sim_time', 'start_type_description_service', 'qos_overrides')


def of_the_world(node: str) -> tuple[str, ...]:
    """A node's parameters that come from the world unless they are set; comments in cell.yaml."""
    if node == 'perception_node':
        # Brings scipy, which what only starts nodes does without.
        from likeme_perception.node_settings import GEOMETRY

        return GEOMETRY
    return {'inference_node': ('goal_prior',), 'arm_driver': ('initial_states',)}.get(node, ())


def validated(path: Path) -> Path:
    """The absolute path of a ROS parameter file, once it is found valid.

    Raises:
        ValueError: it is no YAML, not of the form node: ros__parameters: name: value, or has an
            unknown node or parameter.
    """
    nodes = read_yaml(path)
    well_formed = isinstance(nodes, dict) and all(
        isinstance(node, dict) and 'ros__parameters' in node for node in nodes.values()
    )
    if not well_formed:
        raise ValueError(
            f'expected node: ros__parameters: name: value in {path}, see config/cell.yaml'
        )
    known = read_yaml(Path(get_package_share_directory('likeme_bringup'), 'config', 'cell.yaml'))
    for name, node in nodes.items():
        _check_names(path, name, node['ros__parameters'] or {}, known)
    return path.resolve()


def last_value(paths: Iterable[Path], node: str, name: str) -> Any:
    """What valid parameter files set a node's parameter to, the last one deciding; else None."""
    values = [
        section['ros__parameters'][name]
        for path in paths
        for key, section in read_yaml(path).items()
        if key.rpartition('/')[2] in (node, '*', '**')
        and name in (section['ros__parameters'] or {})
    ]
    return values[-1] if values else None


def _check_names(
    path: Path, node: str, parameters: Mapping[str, object], known: Mapping[str, Any]
) -> None:
    """Refuse unknown names, which ROS would ignore silently."""
    nodes = [node.rpartition('/')[2]] if not node.endswith('*') else list(known)
    if nodes[0] not in known:
        raise ValueError(f'expected one of the nodes {", ".join(known)} in {path}, got {node!r}')
    names = [
        name for each in nodes for name in (*known[each]['ros__parameters'], *of_the_world(each))
    ]
    for name in parameters:
        if name not in names and name.partition('.')[0] not in COMMON:
            like = get_close_matches(name, names, n=1, cutoff=0.4)
            hint = f'; {like[0]}?' if like else ''
            raise ValueError(f'{node} has no parameter {name!r}{hint} ({path})')

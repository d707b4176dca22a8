"""Writes config/cell.yaml from the parameters that the nodes declare.

scripts/run.sh python tools/cell_yaml.py FILE
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import cast

import rclpy
from domain_coordinator import domain_id
from rclpy.node import Node
from rclpy.parameter import Parameter

from likeme_bringup.parameter_files import COMMON, of_the_world
from likeme_bringup.ros.param_command import flow, limits
from likeme_bringup.start_cell import MODULES

HEADER = """\
# Every parameter of every node, with its default and its range. A copy to start from: keep what
# you change and start with `scripts/start_cell.sh --params FILE` or the launch file's
# `params_file:=FILE`. What is commented out comes from the world file unless it is set; the values
# are those of chung2015. Written by tools/cell_yaml.py; a test keeps it true."""
# Not a part of the cell, and started by itself.
GAZE = 'likeme_gaze.gaze_node'


def node_class(module: str) -> Callable[[], Node]:
    """The one node class a module defines."""
    members = vars(importlib.import_module(module)).values()
    kinds = [
        m
        for m in members
        if isinstance(m, type) and issubclass(m, Node) and m.__module__ == module
    ]
    if len(kinds) != 1:
        raise ValueError(f'Expected one node class in {module}, got {len(kinds)}.')
    return kinds[0]


def section(node: Node) -> Iterator[str]:
    """The YAML lines of one node; none of one without parameters."""
    # Annotated as values in rclpy 7.1; they are parameters.
    every = cast(dict[str, Parameter], node.get_parameters_by_prefix(''))
    parameters = {n: each for n, each in every.items() if n.partition('.')[0] not in COMMON}
    if parameters:
        yield from ('', f'{node.get_name()}:', '  ros__parameters:')
    for name, parameter in parameters.items():
        about = node.describe_parameter(name)
        yield f'    # {about.description.rstrip(".")}{limits(about)}.'
        # Their values here would put the geometry of one world into another.
        mark = '# ' if name in of_the_world(node.get_name()) else ''
        yield f'    {mark}{name}: {flow(parameter.value)}'


def cell_yaml() -> str:
    """The whole file, from nodes made for the purpose on a ROS domain of their own."""
    lines = [HEADER]
    with domain_id() as domain:
        rclpy.init(args=['--ros-args', '--log-level', 'fatal'], domain_id=domain)
        try:
            for module in (*MODULES.values(), GAZE):
                node = node_class(module)()
                lines += section(node)
                node.destroy_node()
        finally:
            rclpy.try_shutdown()
    return '\n'.join(lines) + '\n'


if __name__ == '__main__':
    Path(sys.argv[1]).write_text(cell_yaml(), encoding='utf-8')

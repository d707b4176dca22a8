"""Perception and inference nodes that are started for one replay."""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import yaml

from likeme_core.instance_lock import is_free
from likeme_core.processes import running

PARTS = ('perception', 'inference')
#: s from SIGINT to SIGKILL.
SHUTDOWN_TIMEOUT = 20.0


def nodes_run_on(domain: int) -> bool:
    """Whether perception or inference already runs on a ROS domain of this host."""
    return not is_free(domain, PARTS)


@contextmanager
def managed_nodes(domain: int, parameters: Mapping[str, Mapping[str, Any]]) -> Iterator[Path]:
    """Run both nodes with these parameters; yields the file with their output."""
    with tempfile.TemporaryDirectory(prefix='likeme-replay-') as folder:
        log = Path(folder) / 'nodes.log'
        command = [sys.executable, '-m', 'likeme_bringup.start_cell', '--domain', str(domain)]
        # A restarted node would not have read what the recording has played.
        command += ['--no-respawn']
        command += [word for part in PARTS for word in ('--only', part)]
        if parameters:
            file = Path(folder) / 'parameters.yaml'
            file.write_text(ros_parameters(parameters), encoding='utf-8')
            command += ['--params', str(file)]
        with log.open('wb') as sink, running(command, sink, SHUTDOWN_TIMEOUT):
            yield log


def ros_parameters(parameters: Mapping[str, Mapping[str, Any]]) -> str:
    """A ROS parameter file; empty lists, which it cannot hold, keep their defaults."""
    nodes = {
        node: {'ros__parameters': {n: v for n, v in values.items() if v != []}}
        for node, values in parameters.items()
    }
    return str(yaml.safe_dump(nodes, sort_keys=False))

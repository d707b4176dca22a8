"""The name of the simulated robot: a digest of every number that may change how a trial ends."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace
from enum import Enum
from functools import cache
from hashlib import sha256
from typing import Any

from likeme_arm_sim.cell import CellSettings
from likeme_arm_sim.kinect_noise import KinectNoise
from likeme_core.world import World
from likeme_core.world.values import ObjectEntry
from likeme_perception.config import world_config

#: Increment when the procedure of a trial changes.
PROTOCOL = 2
#: Digest -> name, for robots whose trials were recorded under a name computed otherwise. When a
#: field is renamed or added and no trial changes (test_release_files.py makes some again), give
#: the new digest the old name.
RECORDED_NAMES: Mapping[str, str] = {
    '4895b6284f75eddd': 'sim-83d81ca7',
}


@cache
def simulated_robot(world: World) -> str:
    """The name of the robot that makes the trials; a robot with other numbers has another name."""
    digest = digest_of(robot_document(world))
    return RECORDED_NAMES.get(digest, f'sim-{digest[:8]}')


def robot_document(world: World) -> dict[str, Any]:
    """World, cell (physics, arm, primitives), sensor and perception, as JSON-ready values."""
    parts = {
        'protocol': PROTOCOL,
        'world': world_document(world),
        'cell': CellSettings(initial_states={}),
        'sensor': KinectNoise(),
        'perception': replace(world_config(world), world=None),
    }
    return {name: canonical(part) for name, part in parts.items()}


def world_document(world: World) -> dict[str, Any]:
    """Everything in a world file that may change how a trial ends; not where the file is."""
    return {
        # Without what tells a light in which the table saturates: trials are made in another.
        'table': {k: v for k, v in vars(world.table).items() if k != 'dark'},
        # Without a roll of 0, as released robots were digested before cameras had one.
        'camera': {k: v for k, v in vars(world.camera).items() if k != 'roll' or v},
        'regions': [
            {'name': entry.state.name} | {k: v for k, v in vars(entry).items() if k != 'colour'}
            for entry in world.region_entries
        ],
        'actions': [[a.name, a.manner.name, a.target.name] for a in world.actions],
        'objects': [
            {'name': entry.name, 'looks': entry.looks, 'simulation': _with_meshes(entry, world)}
            for entry in world.object_entries
        ],
    }


def _with_meshes(entry: ObjectEntry, world: World) -> dict[str, Any] | None:
    """An object's simulation with a digest of each mesh file instead of its name."""
    if entry.simulation is None:
        return None
    parts = [
        {**part, 'mesh': sha256((world.folder / part['mesh']).read_bytes()).hexdigest()}
        if 'mesh' in part
        else part
        for part in entry.simulation['parts']
    ]
    physics = {k: v for k, v in entry.simulation.items() if k not in ('parts', 'fit')}
    return physics | {'parts': parts}


def digest_of(document: Mapping[str, Any]) -> str:
    """16 hexadecimal digits of the SHA-256 of the document's canonical JSON (sorted keys)."""
    text = json.dumps(document, sort_keys=True, separators=(',', ':'), allow_nan=False)
    return sha256(text.encode()).hexdigest()[:16]


def canonical(value: Any) -> Any:
    """A value as JSON: a dataclass is its field names and values, whatever its class is called.

    Raises:
        TypeError: a value is neither a number, a string, None, nor made of such.
    """
    if is_dataclass(value):
        return {field.name: canonical(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, Mapping):
        return {str(key): canonical(each) for key, each in value.items()}
    if isinstance(value, (list, tuple)):
        return [canonical(each) for each in value]
    if isinstance(value, Enum):
        return value.name
    if value is None or isinstance(value, (bool, str)):
        return value
    if isinstance(value, (int, float)):
        # 0 and 0.0 are the same number.
        return float(value)
    raise TypeError(f'Expected numbers, strings and None, got {type(value).__name__}.')

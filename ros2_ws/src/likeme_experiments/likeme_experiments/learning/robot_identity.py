"""The name of the simulated robot: a digest of every number that may change how a trial ends."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from hashlib import sha256
from typing import Any

from likeme_arm_sim.cell import CellSettings
from likeme_arm_sim.kinect_noise import KinectNoise
from likeme_arm_sim.scene import Scene
from likeme_perception.config import PerceptionConfig

#: Increment when the procedure of a trial changes.
PROTOCOL = 2
#: Digest -> name, for robots whose trials were recorded under a name computed otherwise. When a
#: field is renamed and no number changes, add the new digest with the old name.
RECORDED_NAMES: Mapping[str, str] = {
    '0e3046667401bbd6': 'sim-83d81ca7',
}


def simulated_robot() -> str:
    """The name of the robot that makes the trials; a robot with other numbers has another name."""
    digest = digest_of(robot_document())
    return RECORDED_NAMES.get(digest, f'sim-{digest[:8]}')


def robot_document() -> dict[str, Any]:
    """Scene, cell (physics, arm, primitives), sensor and perception, as JSON-ready values."""
    parts = {
        'protocol': PROTOCOL,
        'scene': Scene(),
        'cell': CellSettings(initial_states={}),
        'sensor': KinectNoise(),
        'perception': PerceptionConfig(),
    }
    return {name: canonical(part) for name, part in parts.items()}


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

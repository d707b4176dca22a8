"""The configuration of a real arm: what the driver needs to know of it, from a YAML file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from likeme_arm.primitive_poses import PrimitiveSettings
from likeme_arm.tool_pose import Vector
from likeme_core.yaml_files import read_yaml

#: Greatest acceleration of a quintic from rest to rest over 1 rad in 1 s, rad/s^2.
QUINTIC = 10 / 3**0.5
CONFIGS = Path(__file__).parents[1] / 'arms'


@dataclass(frozen=True)
class GripperConfig:
    """A parallel gripper with one position.

    Attributes:
        kind: 'commands': a position controller's topic (Float64MultiArray); 'gripper_command': an
            action control_msgs/GripperCommand.
        name: of that topic or action.
        joint: in joint_states.
        positions: of that joint (open, closed), rad or m.
        width: between the fingers when open, m; closed it is 0, and linear between.
        empty_width: narrower than any object: fingers that close to less hold nothing, m.
        max_effort: of a GripperCommand, in its controller's unit.
        timeout: for the fingers to come to rest, s.
    """

    kind: str
    name: str
    joint: str
    positions: tuple[float, float]
    width: float
    empty_width: float
    max_effort: float
    timeout: float

    def position(self, width: float) -> float:
        """The joint's position at a width between the fingers (m)."""
        opened, closed = self.positions
        share = min(max(width / self.width, 0.0), 1.0)
        return closed + share * (opened - closed)

    def width_at(self, position: float) -> float:
        """The width between the fingers (m) at a position of the joint."""
        opened, closed = self.positions
        return self.width * (position - closed) / (opened - closed)


@dataclass(frozen=True)
class Tolerances:
    """When a motion is given up.

    Attributes:
        state_timeout: without joint_states, s.
        lag: by which the arm may be behind its trajectory, s.
        message_delay: until a message reaches the controller, s: a stop keeps to the limits
            wherever the arm is by then.
        tracking: distance of a joint from the trajectory, rad.
        goal: of a joint from the goal, at its end, rad.
        goal_time: after the trajectory's end, in which the goal must be reached, s.
    """

    state_timeout: float
    lag: float
    message_delay: float
    tracking: float
    goal: float
    goal_time: float


@dataclass(frozen=True, eq=False)
class ArmConfig:
    """One arm. Lengths m, angles rad, in base_link, whose z = 0 is the table's top.

    Attributes:
        name: of the file.
        urdf: path, or package://NAME/PATH.
        base: (x, y, z, yaw) of the URDF's root.
        tool_frame: a frame of the URDF.
        tool_offset: of the grasp point in that frame: (x, y, z, roll, pitch, yaw); z of the result
            points along the fingers, y is the direction in which they close.
        joints: names, in the controller's order.
        controller: name of the joint trajectory controller.
        home, ready: joint angles out of the camera's view; over the table, tool down.
        max_velocity, max_acceleration, max_jerk: of each joint, rad/s, rad/s^2, rad/s^3.
        speed: factor on the primitives' speeds.
        workspace: (x_min, x_max), (y_min, y_max), (z_min, z_max) that no part of the arm leaves.
        person_reach: how far any part of the arm may get past the table's edge on the person's
            sides.
        table_clearance: of all links but the fingers, from the table.
        finger_links: links that come near the table and the objects.
        object_clearance: from other objects that the camera sees.
    """

    name: str
    urdf: str
    base: tuple[float, float, float, float]
    tool_frame: str
    tool_offset: tuple[float, ...]
    joints: tuple[str, ...]
    controller: str
    home: Vector
    ready: Vector
    max_velocity: Vector
    max_acceleration: Vector
    max_jerk: Vector
    speed: float
    workspace: tuple[tuple[float, float], ...]
    person_reach: float
    table_clearance: float
    finger_links: tuple[str, ...]
    object_clearance: float
    gripper: GripperConfig
    tolerances: Tolerances
    primitives: PrimitiveSettings

    @property
    def lead(self) -> float:
        """s before a trajectory in which its controller takes the arm to its begin.

        That is at most tolerances.goal away; a quintic that far keeps to the accelerations.
        """
        return float(np.sqrt(QUINTIC * self.tolerances.goal / self.max_acceleration.min()))


def shipped_configs() -> tuple[str, ...]:
    """Names of the configurations that come with this package."""
    return tuple(sorted(path.stem for path in CONFIGS.glob('*.yaml')))


def load_arm_config(source: str) -> ArmConfig:
    """A shipped configuration by its name, or a file by its path.

    Raises:
        ValueError: there is none, or it is not valid; expected and got in one sentence.
    """
    path = CONFIGS / f'{source}.yaml' if source in shipped_configs() else Path(source)
    if not path.is_file():
        known = ', '.join(shipped_configs())
        raise ValueError(f"Expected an arm of {known} or a file, got '{source}'.")
    content = _Section(path.name, '', read_yaml(path))
    try:
        return _arm_config(path, content)
    except TypeError as error:
        raise ValueError(f'{path.name}: {error}.') from None


def _arm_config(path: Path, given: _Section) -> ArmConfig:
    joints, limits = given.strings('joints'), given.section('limits')
    count = len(joints)
    tool, gripper, tolerances = (given.section(n) for n in ('tool', 'gripper', 'tolerances'))
    kind = gripper.string('kind')
    if kind not in ('commands', 'gripper_command'):
        raise ValueError(f"{path.name}: expected gripper.kind commands or gripper_command, "
                         f"got '{kind}'.")  # fmt: skip
    opened, closed = gripper.numbers('positions', 2)
    if opened == closed:
        raise ValueError(f'{path.name}: expected two different gripper.positions, got {opened:g}.')
    config = ArmConfig(
        name=path.stem,
        urdf=_urdf(path, given.string('urdf')),
        base=given.numbers('base', 4),  # type: ignore[arg-type]
        tool_frame=tool.string('frame'),
        tool_offset=tool.numbers('offset', 6),
        joints=joints,
        controller=given.string('controller'),
        home=np.array(given.numbers('home', count)),
        ready=np.array(given.numbers('ready', count)),
        max_velocity=np.array(limits.positive('velocity', count)),
        max_acceleration=np.array(limits.positive('acceleration', count)),
        max_jerk=np.array(limits.positive('jerk', count)),
        speed=given.positive('speed', 1)[0],
        workspace=_workspace(path, given.section('workspace')),
        person_reach=given.number('person_reach'),
        table_clearance=given.number('table_clearance'),
        finger_links=given.strings('finger_links'),
        object_clearance=given.number('object_clearance'),
        gripper=GripperConfig(
            kind,
            gripper.string('name'),
            gripper.string('joint'),
            (opened, closed),
            gripper.positive('width', 1)[0],
            gripper.positive('empty_width', 1)[0],
            gripper.number('max_effort'),
            gripper.positive('timeout', 1)[0],
        ),
        tolerances=Tolerances(
            **{f.name: tolerances.positive(f.name, 1)[0] for f in fields(Tolerances)}
        ),
        primitives=PrimitiveSettings(**given.section('primitives').all_numbers()),
    )
    given.check_complete()
    return config


def _urdf(path: Path, urdf: str) -> str:
    """A path relative to the configuration's own folder made absolute."""
    return urdf if urdf.startswith('package://') else str(path.parent.joinpath(urdf).resolve())


def _workspace(path: Path, given: _Section) -> tuple[tuple[float, float], ...]:
    spans = tuple(given.numbers(axis, 2) for axis in 'xyz')
    for axis, (low, high) in zip('xyz', spans, strict=True):
        if not low < high:
            raise ValueError(
                f'{path.name}: expected workspace.{axis} from low to high, got {low:g}, {high:g}.'
            )
    return spans  # type: ignore[return-value]


class _Section:
    """A mapping of the file, whose values are taken with their checks."""

    def __init__(self, file: str, name: str, given: Any) -> None:
        self._file, self._name = file, name
        if not isinstance(given, Mapping):
            raise ValueError(f'{file}: expected {name or "it"} to be a mapping, got {given!r}.')
        self._given, self._taken = given, set[str]()
        self._sections: list[_Section] = []

    def section(self, key: str) -> _Section:
        found = _Section(self._file, self._full(key), self._take(key))
        self._sections.append(found)
        return found

    def string(self, key: str) -> str:
        value = self._take(key)
        if not isinstance(value, str) or not value:
            raise self._error(key, 'a name', value)
        return value

    def strings(self, key: str) -> tuple[str, ...]:
        value = self._take(key)
        good = isinstance(value, list) and value and all(isinstance(v, str) for v in value)
        if not good or len(set(value)) < len(value):
            raise self._error(key, 'a list of different names', value)
        return tuple(value)

    def number(self, key: str) -> float:
        return self.numbers(key, 1)[0]

    def numbers(self, key: str, count: int) -> tuple[float, ...]:
        value = self._take(key)
        values = value if isinstance(value, list) else [value]
        good = all(isinstance(v, int | float) and not isinstance(v, bool) for v in values)
        if not good or len(values) != count or not np.isfinite(values).all():
            raise self._error(key, f'{count} number{"s" * (count > 1)}', value)
        return tuple(float(v) for v in values)

    def positive(self, key: str, count: int) -> tuple[float, ...]:
        values = self.numbers(key, count)
        if min(values) <= 0:
            raise self._error(key, 'positive numbers', list(values))
        return values

    def all_numbers(self) -> dict[str, float]:
        return {str(key): self.number(str(key)) for key in self._given}

    def check_complete(self) -> None:
        unknown = sorted({str(key) for key in self._given} - self._taken)
        if unknown:
            raise ValueError(f'{self._file}: got {self._full(unknown[0])}, which is not known.')
        for section in self._sections:
            section.check_complete()

    def _take(self, key: str) -> Any:
        if key not in self._given:
            raise ValueError(f'{self._file}: expected {self._full(key)}, got none.')
        self._taken.add(key)
        return self._given[key]

    def _full(self, key: str) -> str:
        return f'{self._name}.{key}' if self._name else key

    def _error(self, key: str, expected: str, got: Any) -> ValueError:
        shown = ', '.join(map(str, got)) if isinstance(got, Sequence) and got else repr(got)
        return ValueError(
            f'{self._file}: expected {self._full(key)} to be {expected}, got {shown}.'
        )

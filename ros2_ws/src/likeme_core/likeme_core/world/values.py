"""What a world file describes; lengths in m, in base_link (x forward, y left, z up)."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

from likeme_core.camera_mount import CameraMount
from likeme_core.geometry import Area, Polygon, Rectangle
from likeme_core.regions import Regions
from likeme_core.table import Colour, Table
from likeme_core.tabletop import Action, Manner, State

T = TypeVar('T', State, Action)

#: RGB of regions without a colour, in their order.
PALETTE: tuple[Colour, ...] = (
    (64, 196, 255),
    (255, 176, 59),
    (255, 105, 135),
    (150, 220, 110),
    (200, 150, 255),
    (240, 230, 90),
)
#: What a person or a message says of an object whose state is not known; no region's name.
UNKNOWN = 'UNKNOWN'


@dataclass(frozen=True)
class Span:
    """A rectangle to draw places from, each axis from its first to its second number, m."""

    x: tuple[float, float]
    y: tuple[float, float]


class Heading(NamedTuple):
    """A direction on the table plane: unit vector, and its angle from +x, rad."""

    x: float
    y: float
    yaw: float


@dataclass(frozen=True)
class PushTarget:
    """Where and in which directions the robot pushes objects into a region.

    Attributes:
        aim: where the pushed object should come to lie, (x, y).
        headings: directions of the push; of several, the one nearest to the way to `aim` is
            taken. Empty: straight towards `aim`.
    """

    aim: tuple[float, float]
    headings: tuple[Heading, ...] = ()


@dataclass(frozen=True)
class RegionEntry:
    """One state of objects: an area of the table, or everywhere else.

    Attributes:
        area: None: everywhere else.
        reachable: whether the robot picks up and pushes objects that are there.
        place: where the robot releases an object, (x, y).
        push: how it pushes one there.
        start: where the simulator sets an object that starts there.
        person: where the simulated person puts an object; None: past the nearer side edge of the
            table, x within `person_x`.
        colour: RGB, in pictures.
    """

    state: State
    area: Area | None
    reachable: bool
    place: tuple[float, float]
    push: PushTarget
    start: Rectangle
    person: Span | None
    person_x: tuple[float, float]
    colour: Colour


@dataclass(frozen=True, eq=False)
class ObjectEntry:
    """One object.

    Attributes:
        looks: what perception's catalogue needs to identify it, as in the file.
        simulation: shape and physics for the simulator, as in the file; None: real only.
        start: where it is when the simulated cell starts; None: where the file leaves it open.
    """

    name: str
    looks: Mapping[str, Any]
    simulation: Mapping[str, Any] | None
    start: State | None


class StoryStep(NamedTuple):
    """One demonstration of the world's demo: a person moves an object from `start` to `end`."""

    object: str
    start: State
    end: State
    manner: Manner


@dataclass(frozen=True, eq=False)
class World:
    """Everything that a world file describes.

    Attributes:
        name, description: as in the file.
        source: what load_world reads it from: the name of a shipped world, or the file's path.
        folder: of the file, from which its meshes are read.
        person_sides, robot_sides: sides of the table, as the robot sees them, over which hand and
            arm enter: near, far, left, right.
        region_entries, actions, object_entries: in the order of their numbers.
        story: what the demo shows.
    """

    name: str
    description: str
    source: str
    folder: Path
    table: Table
    camera: CameraMount
    person_sides: tuple[str, ...]
    robot_sides: tuple[str, ...]
    region_entries: tuple[RegionEntry, ...]
    actions: tuple[Action, ...]
    object_entries: tuple[ObjectEntry, ...]
    story: tuple[StoryStep, ...] = ()

    @cached_property
    def states(self) -> tuple[State, ...]:
        """The values of X_i, X_f and G, in the order of their numbers."""
        return tuple(entry.state for entry in self.region_entries)

    @cached_property
    def objects(self) -> tuple[str, ...]:
        """The names of the objects, in their order."""
        return tuple(item.name for item in self.object_entries)

    @cached_property
    def manners(self) -> tuple[Manner, ...]:
        """The manners that the actions have, in the order of Manner."""
        return tuple(sorted({action.manner for action in self.actions}))

    @cached_property
    def regions(self) -> Regions:
        """What the states mean on the table plane."""
        areas = tuple(entry.area for entry in self.region_entries)
        return Regions(self.states, areas, self.table.thickness)

    @cached_property
    def out_of_reach(self) -> frozenset[State]:
        """States from which the robot cannot move an object."""
        return frozenset(entry.state for entry in self.region_entries if not entry.reachable)

    def state(self, value: int | str) -> State:
        """The state of a number or a name, in any case.

        Raises:
            ValueError: the world has none of it.
        """
        return _member(self.states, value, f'a state of {self.name}')

    def action(self, value: int | str) -> Action:
        """The action of a number or a name, in any case.

        Raises:
            ValueError: the world has none of it.
        """
        return _member(self.actions, value, f'an action of {self.name}')

    def action_of(self, manner: Manner, target: State) -> Action | None:
        """The action of a manner and a target; None if the robot has none."""
        return self._actions_by_aim.get((manner, target))

    def action_to(self, target: State) -> Action:
        """How a person brings an object to a state: by placing it, or by the first other action.

        Raises:
            ValueError: no action is aimed there.
        """
        found = [action for action in self.actions if action.target == target]
        if not found:
            raise ValueError(f'Expected an action of {self.name} aimed at {target}, got none.')
        placing = self.action_of(Manner.PLACE, target)
        return found[0] if placing is None else placing

    def state_at(self, number: int) -> State | None:
        """The state of a number in a message; None if it is none's."""
        return self.states[number] if 0 <= number < len(self.states) else None

    def action_at(self, number: int) -> Action | None:
        """The action of a number in a message; None if it is none's."""
        return self.actions[number] if 0 <= number < len(self.actions) else None

    def object(self, name: str) -> ObjectEntry:
        """The object of a name.

        Raises:
            ValueError: there is none.
        """
        for item in self.object_entries:
            if item.name == name:
                return item
        raise ValueError(f"Expected one of {', '.join(self.objects)}, got '{name}'.")

    def only(self, *names: str) -> World:
        """The same world with these objects alone.

        Raises:
            ValueError: there is none of a name.
        """
        return replace(self, object_entries=tuple(self.object(name) for name in names))

    def region(self, state: int) -> RegionEntry:
        """The entry of a state's region."""
        return self.region_entries[state]

    @cached_property
    def digest(self) -> str:
        """Identifies what the numbers in messages mean: 12 hexadecimal digits.

        It covers the names and areas of the regions, the actions and the names of the objects;
        not what objects look like, physics, camera or colours.
        """
        meaning = {
            'name': self.name,
            'regions': [
                [entry.state.name, _area_numbers(entry.area), entry.reachable]
                for entry in self.region_entries
            ],
            'actions': [[a.name, a.manner.name, a.target.name] for a in self.actions],
            'objects': list(self.objects),
        }
        return hashlib.sha256(json.dumps(meaning).encode()).hexdigest()[:12]

    @property
    def label(self) -> str:
        """Name and digest, as messages, bags and stores carry them."""
        return label_of(self.name, self.digest)

    def check_label(self, theirs: str) -> None:
        """Refuse what is of another world; an empty label is not checked.

        Raises:
            ValueError: with both worlds' names and digests.
        """
        if theirs and theirs != self.label:
            raise ValueError(f'Expected the world {self.label}, got {theirs}.')

    @cached_property
    def _actions_by_aim(self) -> dict[tuple[Manner, State], Action]:
        return {(action.manner, action.target): action for action in self.actions}


def label_of(name: str, digest: str) -> str:
    """Name and digest of a world in one text."""
    return f'{name}@{digest}'


def _area_numbers(area: Area | None) -> list[float]:
    if area is None:
        return []
    if isinstance(area, Polygon):
        return [value for vertex in area.vertices for value in vertex]
    return [area.x_min, area.x_max, area.y_min, area.y_max]


def _member(members: tuple[T, ...], value: int | str, what: str) -> T:
    for member in members:
        if isinstance(value, str):
            if member.name.lower() == value.lower():
                return member
        elif int(member) == value and not isinstance(value, bool):
            return member
    names = ', '.join(member.name.lower() for member in members)
    raise ValueError(f'Expected {what} ({names}), got {value!r}.')

"""Objects that were never taught, and the taught ones in any pose, one at a time on the table."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from likeme_arm_sim.background import cell_background
from likeme_arm_sim.kinect import Kinect
from likeme_arm_sim.meshes import ConvexMesh, box, capsule, ellipsoid, lathe
from likeme_arm_sim.renderer import MeshRenderer, RenderBody
from likeme_arm_sim.toys import toys_of
from likeme_core.paper_world import WORLD
from likeme_perception.catalogue import world_catalogue
from likeme_perception.config import world_config
from likeme_perception.observation import TableObservation
from likeme_perception.pipeline import TabletopPerception
from likeme_perception.rgbd import Intrinsics, RgbdFrame, depth_in_metres

#: Shortest and longest extent, m, of objects that were never taught.
EXTENTS = 0.02, 0.20
#: Frames for which each object is seen; it is judged in the last.
FRAMES = 3
#: Distance, m, of an object's middle from the table's edges.
MARGIN = 0.07


@dataclass(frozen=True)
class Body:
    """Parts and pose of one object; name: empty if it was never taught."""

    name: str
    parts: tuple[ConvexMesh, ...]
    pose: np.ndarray

    def drawn(self) -> list[RenderBody]:
        """What a camera draws."""
        return [RenderBody(part, self.pose) for part in self.parts]


@dataclass
class Identified:
    """Counts of objects, and of those called unknown and published as such."""

    shown: int = 0
    unknown: int = 0
    published: int = 0
    #: Of the shown: those in the colours of a taught object.
    alike: int = 0
    alike_unknown: int = 0


def never_taught(rng: np.random.Generator) -> tuple[Body, bool]:
    """An object of random shape, size and colour; whether the colour is a taught object's."""
    alike = bool(rng.random() < 0.5)
    colour = _taught_colour(rng) if alike else rng.integers(20, 236, 3)
    rgb = (int(colour[0]), int(colour[1]), int(colour[2]))
    low, high = np.log(EXTENTS)
    a, b, c = np.exp(rng.uniform(low, high, 3)) / 2
    kind = rng.integers(4)
    if kind == 0:
        part = box((2 * a, 2 * b, 2 * c), rgb)
    elif kind == 1:
        part = ellipsoid((a, b, c), rgb)
    elif kind == 2:
        part = lathe([(-a, b), (a, b)], rgb)
    else:
        part = capsule((-a, 0, 0), (a, 0, 0), min(b, 0.05), rgb)
    turn = Rotation.from_euler('z', rng.uniform(0, 360), degrees=True)
    return _resting('', (part,), turn, rng), alike


def taught(name: str, rng: np.random.Generator) -> Body:
    """A toy on its side with any roll, or, one in five, standing on an end."""
    roll = Rotation.from_euler('x', rng.uniform(0, 360), degrees=True)
    stand = Rotation.from_euler('y', 90 * rng.choice([-1, 1]), degrees=True)
    turn = Rotation.from_euler('z', rng.uniform(0, 360), degrees=True)
    pose = turn * (stand if rng.random() < 0.2 else roll)
    return _resting(name, toys_of(WORLD)[name].parts, pose, rng)


def _taught_colour(rng: np.random.Generator) -> np.ndarray:
    """RGB drawn from the colours of a toy."""
    known = world_catalogue(WORLD).objects
    part = known[rng.integers(len(known))].colour[0]
    lab = rng.normal(part.mean, part.deviation).astype(np.float32)
    rgb = cv2.cvtColor(lab[None, None], cv2.COLOR_LAB2RGB)[0, 0]
    return np.asarray(np.clip(np.rint(255 * rgb), 0, 255))


def _resting(
    name: str, parts: tuple[ConvexMesh, ...], turn: Rotation, rng: np.random.Generator
) -> Body:
    """The parts, turned, somewhere on the table with their lowest point at its height."""
    corners = turn.apply(np.concatenate([part.vertices for part in parts]))
    top, pose = WORLD.table.top, np.eye(4)
    x = rng.uniform(top.x_min + MARGIN, top.x_max - MARGIN)
    y = rng.uniform(top.y_min + MARGIN, top.y_max - MARGIN)
    pose[:3, :3], pose[:3, 3] = turn.as_matrix(), (x, y, -corners[:, 2].min())
    return Body(name, parts, pose)


class EmptyTable:
    """The simulated cell's camera over its table, on which one scene after another is put."""

    def __init__(self, seed: int) -> None:
        mount = WORLD.camera
        self._renderer = MeshRenderer(mount, cell_background(WORLD.table))
        self._kinect = Kinect(mount, seed=seed)
        lens = Intrinsics(mount.fx, mount.fy, mount.cx, mount.cy, mount.width, mount.height)
        known = world_catalogue(WORLD)
        self._perception = TabletopPerception(world_config(WORLD), lens, known)
        self._stamp = 0
        self.seen([], self._perception.config.background_frames)

    def seen(self, bodies: list[Body], frames: int = FRAMES) -> TableObservation:
        """What perception says of a scene that is there for some frames."""
        self._perception.reset_tracking()
        drawn = [part for body in bodies for part in body.drawn()]
        for _ in range(frames):
            self._stamp += 33_000_000
            images = self._kinect.sense(self._renderer.render(drawn))
            depth = depth_in_metres(images.depth_mm)
            table = self._perception.process(RgbdFrame(self._stamp, 'camera', images.rgb, depth))
        return table


def never_taught_identified(seed: int, count: int) -> Identified:
    """How many objects that were never taught are called unknown."""
    table, rng, found = EmptyTable(seed), np.random.default_rng([seed, 5]), Identified()
    for _ in range(count):
        body, alike = never_taught(rng)
        now = table.seen([body])
        unknown = not any(said.visible for said in now.objects)
        found.shown += 1
        found.unknown += unknown
        found.published += any(not each.fits for each in now.unknown_objects)
        found.alike += alike
        found.alike_unknown += alike and unknown
    return found


def taught_identified(seed: int, count: int) -> Identified:
    """How many taught objects are called unknown."""
    table, rng, found = EmptyTable(seed), np.random.default_rng([seed, 6]), Identified()
    for body in _in_turn(rng, count):
        now = table.seen([body])
        found.shown += 1
        found.unknown += not now.object(body.name).visible
    return found


def _in_turn(rng: np.random.Generator, count: int) -> Iterator[Body]:
    for k in range(count):
        yield taught(WORLD.objects[k % len(WORLD.objects)], rng)


def touching(rng: np.random.Generator) -> list[Body]:
    """Two objects of one random colour that were never taught, side by side and touching."""
    colour = rng.integers(20, 236, 3)
    rgb = (int(colour[0]), int(colour[1]), int(colour[2]))
    first, second = (_resting('', (_compact(rng, rgb),), _about_z(rng), rng) for _ in range(2))
    towards = rng.uniform(0, 2 * np.pi)
    side = np.array([np.cos(towards), np.sin(towards)])
    reach = _reach(first, side) + _reach(second, -side)
    middle = _middle_of_table()
    for body, sign in ((first, -0.5), (second, 0.5)):
        body.pose[:2, 3] = middle + sign * reach * side
    return [first, second]


def _compact(rng: np.random.Generator, rgb: tuple[int, int, int]) -> ConvexMesh:
    """A box, an ellipsoid or a cylinder of 4 to 8 cm."""
    a, b, c = rng.uniform(0.02, 0.04, 3)
    kind = rng.integers(3)
    if kind == 0:
        return box((2 * a, 2 * b, 2 * c), rgb)
    return ellipsoid((a, b, c), rgb) if kind == 1 else lathe([(-a, b), (a, b)], rgb)


def _about_z(rng: np.random.Generator) -> Rotation:
    return Rotation.from_euler('z', rng.uniform(0, 360), degrees=True)


def _reach(body: Body, side: np.ndarray) -> float:
    """Extent, m, of a body from its origin to one side, a unit vector (2,)."""
    corners = np.concatenate([part.vertices for part in body.parts]) @ body.pose[:3, :3].T
    return float((corners[:, :2] @ side).max())


def _middle_of_table() -> np.ndarray:
    top = WORLD.table.top
    return np.array([top.x_min + top.x_max, top.y_min + top.y_max]) / 2


def touching_found(seed: int, count: int) -> tuple[int, int]:
    """Pairs of touching objects of one colour that were seen as the two they are, of so many."""
    table, rng, found = EmptyTable(seed), np.random.default_rng([seed, 7]), 0
    for _ in range(count):
        bodies = touching(rng)
        seen = table.seen(bodies).unknown_objects
        places = [np.array(each.shape.centroid[:2]) for each in seen]
        near = [
            [float(np.linalg.norm(place - body.pose[:2, 3])) < 0.02 for place in places].count(
                True
            )
            for body in bodies
        ]
        found += len(seen) == 2 and near == [1, 1]
    return found, count

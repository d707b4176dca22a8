"""Ray-cast synthetic frames of a table with balls and forearms."""

from __future__ import annotations

import sys
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from likeme_core.paper_world import WORLD
from likeme_perception.camera_view import CameraView
from likeme_perception.catalogue import Catalogue, CatalogueObject
from likeme_perception.colour import ColourComponent
from likeme_perception.config import PerceptionConfig, world_config
from likeme_perception.pipeline import TabletopPerception
from likeme_perception.rgbd import Intrinsics, RgbdFrame

# The helpers of the system tests.
sys.path.insert(0, str(Path(__file__).resolve().parents[4] / 'tests'))

TABLE, FLOOR = (196, 164, 122), (110, 112, 116)
YELLOW, GREEN, SKIN = (235, 205, 30), (90, 150, 40), (222, 170, 140)
SECOND = 1_000_000_000


@dataclass(frozen=True)
class Ball:
    """A ball: centre and radius, m."""

    centre: tuple[float, float, float]
    radius: float
    colour: tuple[int, int, int]


@dataclass(frozen=True)
class Limb:
    """A forearm: a capsule between two points, m."""

    start: tuple[float, float, float]
    end: tuple[float, float, float]
    radius: float = 0.035
    colour: tuple[int, int, int] = SKIN


@dataclass
class FrameRenderer:
    """Renders frames of a table for the cell's camera at a quarter of its pixels."""

    intrinsics: Intrinsics = field(
        default_factory=lambda: Intrinsics(262.5, 262.5, 159.5, 119.5, 320, 240)
    )
    config: PerceptionConfig = field(
        default_factory=lambda: replace(
            world_config(WORLD), background_frames=5, min_object_area=0.0002
        )
    )
    rate: float = 10.0
    stamp: int = 0

    def __post_init__(self) -> None:
        pose = self.config.camera_pose()
        assert pose is not None
        self.view = CameraView(self.intrinsics, pose)
        self._rng = np.random.default_rng(7)
        self._directions = self.view.directions.astype(np.float64)
        self._origin = pose[:3, 3]

    def frame(self, *things: Ball | Limb) -> RgbdFrame:
        """The next frame, 1 / rate later, with a Kinect's depth noise."""
        self.stamp += int(SECOND / self.rate)
        depth = np.full(len(self._directions), np.inf)
        colour = np.zeros((len(depth), 3))
        self._add_ground(depth, colour)
        for thing in things:
            if isinstance(thing, Ball):
                self._add_ball(depth, colour, thing)
            else:
                for share in np.linspace(0, 1, 25):
                    centre = np.array(thing.start) * (1 - share) + np.array(thing.end) * share
                    self._add_ball(depth, colour, Ball(tuple(centre), thing.radius, thing.colour))
        depth += self._rng.normal(0, 0.0012 + 0.0019 * (depth - 0.4) ** 2)
        rgb = np.clip(colour + self._rng.normal(0, 2, colour.shape), 0, 255).astype(np.uint8)
        shape = self.intrinsics.shape
        return RgbdFrame(
            self.stamp, 'camera', rgb.reshape(*shape, 3), depth.reshape(shape).astype(np.float32)
        )

    def _add_ground(self, depth: NDArray[np.float64], colour: NDArray[np.float64]) -> None:
        table = self.config.table
        assert table is not None
        for z, paint in ((0.0, TABLE), (-0.2, FLOOR)):
            t = (z - self._origin[2]) / self._directions[:, 2]
            xy = self._origin[:2] + t[:, None] * self._directions[:, :2]
            hit = (t > 0) & (t < depth)
            if z == 0.0:
                hit &= table.contains(xy[:, 0], xy[:, 1])
            depth[hit], colour[hit] = t[hit], paint
        depth[~np.isfinite(depth)] = 4.0

    def _add_ball(
        self, depth: NDArray[np.float64], colour: NDArray[np.float64], ball: Ball
    ) -> None:
        to = self._origin - np.array(ball.centre)
        a = (self._directions**2).sum(axis=1)
        b = self._directions @ to
        disc = b * b - a * (to @ to - ball.radius**2)
        t = np.where(disc > 0, (-b - np.sqrt(np.maximum(disc, 0))) / a, np.inf)
        hit = (t > 0.1) & (t < depth)
        depth[hit], colour[hit] = t[hit], ball.colour

    def perception(self, catalogue: Catalogue) -> TabletopPerception:
        """Perception that has learned the empty table."""
        perception = TabletopPerception(self.config, self.intrinsics, catalogue)
        for _ in range(self.config.background_frames):
            perception.process(self.frame())
        assert perception.background is not None
        return perception


def ball_entry(name: str, mean: tuple[float, float, float], radius: float) -> CatalogueObject:
    """A catalogue entry of a ball."""
    part = ColourComponent(1.0, mean, (8.0, 4.0, 6.0))
    return CatalogueObject(name, (part,), 2 * radius, 2 * radius, 2 * radius, np.pi * radius**2)


@pytest.fixture
def renderer() -> FrameRenderer:
    """An empty table under the cell's camera."""
    return FrameRenderer()


@pytest.fixture
def catalogue() -> Catalogue:
    """A yellow and a green ball of 3 cm radius."""
    return Catalogue(
        (
            ball_entry('lemon', (82.6, -4.4, 79.6), 0.03),
            ball_entry('pear', (56.5, -33.0, 47.0), 0.03),
        )
    )


@pytest.fixture
def lemon() -> type[Ball]:
    """Factory of a yellow ball that lies at (x, y)."""

    def make(x: float, y: float, z: float = 0.03) -> Ball:
        return Ball((x, y, z), 0.03, YELLOW)

    return make  # type: ignore[return-value]


@pytest.fixture
def pear() -> type[Ball]:
    """Factory of a green ball that lies at (x, y)."""

    def make(x: float, y: float, z: float = 0.03) -> Ball:
        return Ball((x, y, z), 0.03, GREEN)

    return make  # type: ignore[return-value]


@pytest.fixture
def forearm() -> type[Limb]:
    """Factory of a forearm from the far side to (x, y, z)."""

    def make(x: float, y: float, z: float) -> Limb:
        return Limb((x, y, z), (1.1, y, z + 0.25))

    return make  # type: ignore[return-value]


@pytest.fixture
def robot_arm() -> type[Limb]:
    """Factory of an arm from the robot's side to (x, y, z)."""

    def make(x: float, y: float, z: float) -> Limb:
        return Limb((x, y, z), (0.0, 0.0, 0.30), colour=(230, 230, 235))

    return make  # type: ignore[return-value]

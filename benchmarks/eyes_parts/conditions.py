"""The conditions: which frames come, and what is wrong with them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from eyes_parts.recording import RATE, Recording
from eyes_parts.scenes import (
    EVENT,
    BananaForLemon,
    BoxPutDown,
    Bumped,
    ColoursLate,
    HandAtStart,
    HeldStill,
    Scene,
    SecondLemon,
    SmallImage,
    Torn,
)
from likeme_arm_sim.kinect import RgbdImages

#: Changes the images of frame k; acts: first and last frame of each act.
Change = Callable[[RgbdImages, int, list[tuple[int, int]], np.random.Generator], RgbdImages]
#: Whether frame k comes.
Comes = Callable[[int, list[tuple[int, int]], np.random.Generator], bool]


@dataclass(frozen=True)
class Condition:
    """One row of the table; every: of 30 frames a second each so manieth is taken."""

    name: str
    scene: Scene = field(default_factory=Scene)
    change: Change = lambda images, *_: images
    comes: Comes = lambda *_: True
    every: int = 2


def spans(recording: Recording) -> list[tuple[int, int]]:
    """First and last moment of each act."""
    return [(act.first, act.last) for act in recording.acts]


def light(*factors: float, since: int = 0) -> Change:
    """Each channel times a factor from a frame on, saturated at 255."""

    def change(images: RgbdImages, k: int, *_: object) -> RgbdImages:
        if k < since:
            return images
        bright = np.clip(np.rint(images.rgb * np.asarray(factors, np.float32)), 0, 255)
        return images._replace(rgb=bright.astype(np.uint8))

    return change


def light_waves(images: RgbdImages, k: int, *others: Any) -> RgbdImages:
    """The light goes from half to one and a half times and back, every 8 s."""
    level = 1 + 0.5 * np.sin(2 * np.pi * k / (8 * RATE))
    return light(level, level, level)(images, k, *others)


def shadow(images: RgbdImages, k: int, *_: object) -> RgbdImages:
    """A shadow with a soft edge, half as bright and a third as wide as the image, goes over it."""
    rows, columns = images.depth_mm.shape
    x = columns * (0.5 + 0.6 * np.sin(2 * np.pi * k / (10 * RATE)))
    y = rows * (0.5 + 0.3 * np.sin(2 * np.pi * k / (7 * RATE)))
    v, u = np.ogrid[:rows, :columns]
    off = np.hypot(u - x, v - y) / (columns / 6)
    kept = 1 - 0.5 * np.clip((1.2 - off) / 0.4, 0, 1)
    return images._replace(rgb=np.rint(images.rgb * kept[..., None]).astype(np.uint8))


def depth_shifted(images: RgbdImages, k: int, *_: object) -> RgbdImages:
    """The depth is that of the pixel 12 columns to the left, from EVENT on: not registered."""
    if k < EVENT:
        return images
    return images._replace(depth_mm=np.roll(images.depth_mm, 12, axis=1))


def holes(share: float, during: Callable[[int, list[tuple[int, int]]], bool]) -> Change:
    """A share of the depth readings missing at random."""

    def change(
        images: RgbdImages, k: int, acts: list[tuple[int, int]], rng: np.random.Generator
    ) -> RgbdImages:
        if not during(k, acts):
            return images
        kept = rng.random(images.depth_mm.shape, np.float32) >= share
        return images._replace(depth_mm=images.depth_mm * kept)

    return change


def black(images: RgbdImages, k: int, *_: object) -> RgbdImages:
    """No light, and no depth either, for 1 s at rest."""
    if not at_rest_second(k, []):
        return images
    return RgbdImages(images.rgb // 64, images.depth_mm)


def always(_k: int, _acts: object) -> bool:
    """The whole time."""
    return True


def at_rest_second(k: int, _acts: object) -> bool:
    """1 s while nothing has moved yet."""
    return EVENT <= k < EVENT + RATE


def in_acts(k: int, acts: list[tuple[int, int]]) -> bool:
    """1 s from 1 s after the start of each act, about when the object moves."""
    return any(first + RATE <= k < first + 2 * RATE for first, _ in acts)


def half(_k: int, _acts: object, rng: np.random.Generator) -> bool:
    """Every frame with probability 1/2."""
    return bool(rng.random() < 0.5)


def bursts(k: int, acts: list[tuple[int, int]], _rng: object) -> bool:
    """Two bursts of 0.2 to 1 s are missing in every act, at places drawn for it."""
    for first, _ in acts:
        draw = np.random.default_rng([3, first])
        for start, long in zip(draw.uniform(0.2, 3.0, 2), draw.uniform(0.2, 1.0, 2), strict=True):
            if first + start * RATE <= k < first + (start + long) * RATE:
                return False
    return True


CONDITIONS: Sequence[Condition] = (
    Condition('nominal, 30 Hz', every=1),
    Condition('nominal, 15 Hz'),
    *(
        Condition(f'light {level:g}', change=light(level, level, level))
        for level in (0.3, 0.5, 1.5, 2.0, 3.0)
    ),
    Condition('light 0.5 once learned', change=light(0.5, 0.5, 0.5, since=EVENT)),
    Condition('light 1.5 once learned', change=light(1.5, 1.5, 1.5, since=EVENT)),
    Condition('light 2 once learned', change=light(2.0, 2.0, 2.0, since=EVENT)),
    Condition('light from 0.5 to 1.5 and back', change=light_waves),
    Condition('shadow', change=shadow),
    Condition('warm lamp', change=light(1.15, 0.95, 0.6)),
    Condition('cold lamp', change=light(0.75, 0.95, 1.25)),
    Condition('warm lamp, light 2', change=light(2.3, 1.9, 1.2)),
    Condition('cold lamp, light 2', change=light(1.5, 1.9, 2.5)),
    Condition('light 2, banana for the lemon', BananaForLemon(), change=light(2.0, 2.0, 2.0)),
    Condition(
        'light 2, second lemon put down', SecondLemon(since=EVENT), change=light(2.0, 2.0, 2.0)
    ),
    Condition('30 % of the depth missing', change=holes(0.3, always)),
    Condition('black for 1 s', change=black),
    Condition('no depth for 1 s', change=holes(1.1, at_rest_second)),
    Condition('99.9 % of the depth missing in acts', change=holes(0.999, in_acts)),
    *(Condition(f'camera bumped by {d:g} deg', Bumped(degrees=d)) for d in (1.0, 2.0, 5.0)),
    Condition('every fifth frame torn', Torn()),
    Condition('colours late', ColoursLate()),
    Condition('depth not registered', change=depth_shifted),
    Condition('half of the frames', comes=half, every=1),
    Condition('bursts missing in acts', comes=bursts),
    Condition('5 Hz', every=6),
    Condition('box of 30 cm', BoxPutDown()),
    Condition('hand there at the start', HandAtStart()),
    Condition('banana for the lemon', BananaForLemon()),
    Condition('second lemon put down', SecondLemon(since=EVENT)),
    Condition('two lemons at the start', SecondLemon()),
    Condition('320x240', SmallImage()),
    Condition('held still for 22 s', HeldStill()),
)

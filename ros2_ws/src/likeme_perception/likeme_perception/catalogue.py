"""Catalogue of known objects: colour model and extents of each, from a world file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import cv2
import numpy as np
import yaml
from numpy.typing import NDArray

from likeme_core.world import World
from likeme_perception.clipped_colour import clipped_log_density
from likeme_perception.colour import ColourComponent, LogDensity, mixture_log_density, mixture_of
from likeme_perception.light import Caps
from likeme_perception.top_view import Shape

# Share of a round object's extent that is seen from above; its sides are too steep.
_SEEN_SHARE = 0.8


@dataclass(frozen=True)
class CatalogueObject:
    """One known object: colour mixture and top-view extents, m and m^2."""

    name: str
    colour: tuple[ColourComponent, ...]
    length: float
    width: float
    height: float
    area: float


@dataclass(frozen=True)
class Catalogue:
    """The known objects, in the order they are reported."""

    objects: tuple[CatalogueObject, ...]

    def __post_init__(self) -> None:
        names = [o.name for o in self.objects]
        if len(set(names)) < len(names):
            raise ValueError(f'Expected {len(names)} different names, got {len(set(names))}.')

    @cached_property
    def log_density(self) -> LogDensity:
        """log p(colour | object) at each colour bin, (objects, bins)."""
        return np.stack([mixture_log_density(o.colour) for o in self.objects])

    @cached_property
    def best_log_density(self) -> LogDensity:
        """Greatest log p(colour | object) over the catalogue at each colour bin, (bins,)."""
        return np.asarray(self.log_density.max(axis=0), np.float32)

    @cached_property
    def lengths(self) -> NDArray[np.float64]:
        """Length of each object as it was taught, (objects,) m."""
        return np.array([o.length for o in self.objects])

    @cached_property
    def log_poses(self) -> NDArray[np.float64]:
        """Logarithms of length, width and height (m) of each object in its poses, (objects, 3, 3).

        As it was taught, turned on its side, and on end.
        """
        return np.log(np.stack([_poses(o) for o in self.objects]))

    @cached_property
    def longest(self) -> float:
        """Greatest extent of the objects, m; 0 without objects."""
        return max((max(o.length, o.width, o.height) for o in self.objects), default=0.0)

    @cached_property
    def likeliest(self) -> NDArray[np.intp]:
        """Index of the most likely object at each colour bin, (bins,)."""
        return np.asarray(self.log_density.argmax(axis=0))


@dataclass(frozen=True)
class ClippedCatalogue(Catalogue):
    """The known objects as they look where colours are cut off at `caps`.

    Some may look the same then: identities are doubtful, see identification.one_of_each.
    """

    caps: Caps = (255, 255, 255)

    @cached_property
    def log_density(self) -> LogDensity:
        """See clipped_log_density, (objects, bins)."""
        return clipped_log_density([o.colour for o in self.objects], self.caps)


def _poses(known: CatalogueObject) -> NDArray[np.float64]:
    """Length, width and height, m, of an object as taught, on its side, and on end, (3, 3)."""
    length, width, height = known.length, known.width, known.height
    above = _SEEN_SHARE * height
    return np.array(
        [
            (length, width, height),
            (max(length, above), min(length, above), width / _SEEN_SHARE),
            (max(width, above), min(width, above), length / _SEEN_SHARE),
        ]
    )


class ObjectSample(NamedTuple):
    """An object in one frame: RGB pixels (N, 3) uint8, shape, visible area (m^2)."""

    colours: NDArray[np.uint8]
    shape: Shape
    area: float


def catalogue_entry(name: str, samples: Sequence[ObjectSample]) -> CatalogueObject:
    """A catalogue entry from one object in some frames."""
    shapes = [sample.shape for sample in samples]
    rgb = np.concatenate([sample.colours for sample in samples])[None]
    lab = cv2.cvtColor(rgb.astype(np.float32) / np.float32(255), cv2.COLOR_RGB2LAB)[0]
    return CatalogueObject(
        name,
        mixture_of(np.asarray(lab, float)),
        round(float(np.median([s.length for s in shapes])), 4),
        round(float(np.median([s.width for s in shapes])), 4),
        round(float(np.median([s.height for s in shapes])), 4),
        round(float(np.median([sample.area for sample in samples])), 5),
    )


def world_catalogue(world: World) -> Catalogue:
    """The objects of a world by what they look like."""
    return Catalogue(
        tuple(_object_from(entry.name, entry.looks) for entry in world.object_entries)
    )


def _object_from(name: str, looks: Mapping[str, Any]) -> CatalogueObject:
    sizes = (float(looks[key]) for key in ('length', 'width', 'height', 'area'))
    colour = tuple(
        ColourComponent(float(part['weight']), _triple(part['mean']), _triple(part['deviation']))
        for part in looks['colour']
    )
    return CatalogueObject(name, colour, *sizes)


def _triple(values: Sequence[float]) -> tuple[float, float, float]:
    first, second, third = values
    return float(first), float(second), float(third)


def object_yaml(known: CatalogueObject) -> str:
    """An object as an entry of a world file's `objects`."""
    looks = {
        'colour': [
            {
                'weight': round(p.weight, 3),
                'mean': list(p.mean),
                'deviation': list(p.deviation),
            }
            for p in known.colour
        ],
        'length': known.length,
        'width': known.width,
        'height': known.height,
        'area': known.area,
    }
    entry = [{'name': known.name, 'looks': looks}]
    return yaml.safe_dump(entry, sort_keys=False, default_flow_style=None)

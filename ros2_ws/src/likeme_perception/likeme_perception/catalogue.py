"""Catalogue of known objects: colour model and extents of each, read from and written as YAML."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from importlib.resources import files
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import yaml
from numpy.typing import NDArray

from likeme_perception.colour import ColourComponent, LogDensity, mixture_log_density, mixture_of
from likeme_perception.config import yaml_mapping
from likeme_perception.top_view import Shape


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
    def likeliest(self) -> NDArray[np.intp]:
        """Index of the most likely object at each colour bin, (bins,)."""
        return np.asarray(self.log_density.argmax(axis=0))


def catalogue_entry(
    name: str, colours: list[NDArray[np.uint8]], shapes: list[Shape], areas: list[float]
) -> CatalogueObject:
    """A catalogue entry from observations of one object in some frames.

    colours: (N, 3) uint8 RGB pixels of the object, one array per frame.
    """
    rgb = np.concatenate(colours)[None]
    lab = cv2.cvtColor(rgb.astype(np.float32) / np.float32(255), cv2.COLOR_RGB2LAB)[0]
    return CatalogueObject(
        name,
        mixture_of(np.asarray(lab, float)),
        round(float(np.median([s.length for s in shapes])), 4),
        round(float(np.median([s.width for s in shapes])), 4),
        round(float(np.median([s.height for s in shapes])), 4),
        round(float(np.median(areas)), 5),
    )


def load_catalogue(path: Path | None = None) -> Catalogue:
    """Read a catalogue from YAML; None: the one shipped with the package."""
    text = (
        (files('likeme_perception') / 'data' / 'catalogue.yaml').read_text()
        if path is None
        else path.read_text()
    )
    entries = yaml_mapping(text, path).get('objects')
    if not isinstance(entries, dict):
        raise ValueError(
            f'Expected "objects:" with a name for each in {path}, got {type(entries).__name__}.'
        )
    return Catalogue(tuple(_entry_from(str(name), value) for name, value in entries.items()))


def _entry_from(name: str, value: Any) -> CatalogueObject:
    _require(name, {'colour', 'length', 'width', 'height', 'area'}, value)
    for part in value['colour']:
        _require(f'colour of {name}', {'weight', 'mean', 'deviation'}, part)
    parts = tuple(
        ColourComponent(float(p['weight']), tuple(p['mean']), tuple(p['deviation']))
        for p in value['colour']
    )
    size = (float(value[key]) for key in ('length', 'width', 'height', 'area'))
    return CatalogueObject(name, parts, *size)


def _require(name: str, keys: set[str], value: Any) -> None:
    if not isinstance(value, dict):
        raise ValueError(f'Expected "key: value" for {name!r}, got {value!r}.')
    missing = keys - set(value)
    if missing:
        raise ValueError(f'Expected {sorted(missing)[0]!r} of {name!r}, got {sorted(value)}.')


def catalogue_yaml(catalogue: Catalogue) -> str:
    """The catalogue as YAML text, as load_catalogue reads it."""
    objects = {
        o.name: {
            'colour': [
                {
                    'weight': round(p.weight, 3),
                    'mean': list(p.mean),
                    'deviation': list(p.deviation),
                }
                for p in o.colour
            ],
            'length': o.length,
            'width': o.width,
            'height': o.height,
            'area': o.area,
        }
        for o in catalogue.objects
    }
    return yaml.safe_dump({'objects': objects}, sort_keys=False, default_flow_style=None)

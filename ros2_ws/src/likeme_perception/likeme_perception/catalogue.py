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
from likeme_perception.top_view import Shape
from likeme_perception.typed_values import number, read_text, require, triple, yaml_mapping


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
        else read_text(path)
    )
    entries = yaml_mapping(text, path).get('objects')
    if not isinstance(entries, dict):
        raise ValueError(
            f'Expected "objects:" with a name for each in {path}, got {type(entries).__name__}.'
        )
    return Catalogue(tuple(_entry_from(str(name), value) for name, value in entries.items()))


def _entry_from(name: str, value: Any) -> CatalogueObject:
    sizes = ('length', 'width', 'height', 'area')
    entry = require(name, {'colour', *sizes}, value)
    for key in sizes:
        if not 0 < number(f'{key} of {name}', entry[key]) < np.inf:
            raise ValueError(f'Expected {key} of {name} above 0, got {entry[key]}.')
    if not isinstance(entry['colour'], list) or not entry['colour']:
        raise ValueError(f'Expected colour of {name} as a list, got {entry["colour"]!r:.40}.')
    parts = tuple(_colour_from(f'colour of {name}', part) for part in entry['colour'])
    return CatalogueObject(name, parts, *(float(entry[key]) for key in sizes))


def _colour_from(name: str, value: Any) -> ColourComponent:
    part = require(name, {'weight', 'mean', 'deviation'}, value)
    weight = number(f'weight in {name}', part['weight'])
    if not 0 <= weight < np.inf:
        raise ValueError(f'Expected weight in {name} of 0 or more, got {weight:g}.')
    mean, deviation = (triple(f'{key} in {name}', part[key]) for key in ('mean', 'deviation'))
    return ColourComponent(weight, mean, deviation)


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

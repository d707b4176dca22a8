"""What perception would take an object for, by its colours and its size."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from likeme_perception.catalogue import Catalogue, CatalogueObject, ObjectSample
from likeme_perception.colour import Bins, bins_of_lab
from likeme_perception.identification import identity_probability
from likeme_perception.top_view import Shape

#: The name of what is in no catalogue.
UNKNOWN_OBJECT = 'unknown object'
# Pixels and sizes drawn of an object whose images are gone.
_PIXELS, _DRAWS = 400, 24
# Relative deviation of the size of an object as it lies now and then.
_SIZE_DEVIATION = 0.12


class Confusion(NamedTuple):
    """p(it is taken for `taken_for` | it is `object`), averaged over views."""

    object: str
    taken_for: str
    probability: float


def confusions_of_samples(
    catalogue: Catalogue, name: str, samples: Sequence[ObjectSample]
) -> list[Confusion]:
    """What an object is taken for in views of it, most probable first."""
    rows = []
    for sample in samples:
        lab = cv2.cvtColor(sample.colours[None], cv2.COLOR_RGB2LAB)[0]
        rows.append(
            identity_probability(catalogue, bins_of_lab(np.asarray(lab, np.uint8)), sample.shape)
        )
    return _confusions(catalogue, name, rows)


def confusions_with(catalogue: Catalogue, name: str) -> list[Confusion]:
    """What an object of the catalogue is taken for, and which others are taken for it.

    Their images are gone: pixels and sizes are drawn from what the catalogue says of them.

    Raises:
        ValueError: the catalogue has no such object.
    """
    names = [known.name for known in catalogue.objects]
    if name not in names:
        raise ValueError(f'Expected one of {", ".join(names)}, got {name!r}.')
    rng = np.random.default_rng(0)
    found = []
    for known in catalogue.objects:
        rows = [
            identity_probability(catalogue, _drawn_pixels(known, rng), _drawn_shape(known, rng))
            for _ in range(_DRAWS)
        ]
        each = _confusions(catalogue, known.name, rows)
        found += each if known.name == name else [c for c in each if c.taken_for == name]
    return found


def _confusions(
    catalogue: Catalogue, name: str, rows: Sequence[NDArray[np.float64]]
) -> list[Confusion]:
    mean = np.mean(rows, axis=0)
    names = [*(known.name for known in catalogue.objects), UNKNOWN_OBJECT]
    ranked = sorted(zip(names, mean.tolist(), strict=True), key=lambda each: -each[1])
    return [Confusion(name, other, p) for other, p in ranked]


def _drawn_pixels(known: CatalogueObject, rng: np.random.Generator) -> Bins:
    weight = np.array([part.weight for part in known.colour])
    chosen = rng.choice(len(weight), _PIXELS, p=weight / weight.sum())
    mean = np.array([part.mean for part in known.colour])[chosen]
    deviation = np.array([part.deviation for part in known.colour])[chosen]
    lab = rng.normal(mean, deviation) * (2.55, 1.0, 1.0) + (0.0, 128.0, 128.0)
    return bins_of_lab(np.clip(np.rint(lab), 0, 255).astype(np.uint8))


def _drawn_shape(known: CatalogueObject, rng: np.random.Generator) -> Shape:
    length, width = np.array([known.length, known.width]) * np.exp(
        rng.normal(0, _SIZE_DEVIATION, 2)
    )
    return Shape((0.0, 0.0, 0.0), 0.0, float(length), float(width), known.height)

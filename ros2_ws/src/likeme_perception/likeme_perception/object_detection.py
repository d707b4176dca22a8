"""Detection of objects in the foreground: blobs with their shape and identity."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from likeme_perception.background import Background
from likeme_perception.blobs import Blob, Index
from likeme_perception.catalogue import Catalogue, ClippedCatalogue
from likeme_perception.config import PerceptionConfig
from likeme_perception.convex_splitter import ConvexSplitter
from likeme_perception.depth_shadow import detect_in_depth_shadow
from likeme_perception.hand_arm_segmentation import HandArmSegmentation
from likeme_perception.identification import Assignment, assign, fits, identity_probability
from likeme_perception.resting_identities import Resting, RestingIdentities
from likeme_perception.rgbd import RgbdFrame
from likeme_perception.top_view import (
    Shape,
    correct_self_occlusion,
    shape_of,
    top_view_parts,
)
from likeme_perception.touching_objects import merge_parts, split_by_colour
from likeme_perception.visibility import partly_hidden, stands_on_table

ImageB = NDArray[np.uint8]

# An object that stands on its end is at most so many times as high as its seen length: its ends
# are too steep to be seen from above.
_POSES = 1.3
# Least height of an object on the table, in deviations of the bare table's height.
_LEAST_HEIGHT = 6.0
# Area of the smallest convex part, in least areas of an object.
_LEAST_PART = 2.0
# Least probability to call a blob by a name where colours are clipped.
_SURE = 0.9


class ObjectDetection(NamedTuple):
    """An object detected in a frame; identity: probability that it is what it is called.

    beside_limb: a hand or an arm touches it in the image. probability: of each object of the
    catalogue, and of none of them, (objects + 1,).
    """

    blob: Blob
    shape: Shape
    identity: float
    beside_limb: bool
    probability: NDArray[np.float64]


class Detections(NamedTuple):
    """Detections by catalogue index, and those without a name.

    least: probability from which one fits an object.
    """

    named: dict[int, ObjectDetection]
    rest: list[ObjectDetection]
    least: float


class ObjectDetector:
    """Detects and identifies the objects of one frame after another."""

    def __init__(self, config: PerceptionConfig, catalogue: Catalogue) -> None:
        self._config = config
        self._catalogue = catalogue
        self._splitter = ConvexSplitter()
        # Pixels of the named objects of the frame before, in order.
        self._before: list[Index] = []
        self._resting = RestingIdentities()

    def detect(
        self,
        found: HandArmSegmentation,
        limb_mask: ImageB | None,
        frame: RgbdFrame,
        background: Background,
        looks: Catalogue,
    ) -> Detections:
        """The objects of a frame.

        limb_mask: dilated mask of hand and arm, (H, W); None: none is in view. looks: the known
        objects under the light of this frame.
        """
        self._catalogue = looks
        least = max(self._config.min_identity, _SURE if self._clipped else 0.0)

        def detected(blob: Blob, part: bool = False) -> ObjectDetection:
            beside = limb_mask is not None and bool(limb_mask.take(blob.pixels).any())
            return self._detected(blob, beside, part, frame, background)

        seen = [detected(blob) for blob in self._blobs(found, frame, background)]
        whole = [s for s in seen if self._is_known(s) or s.beside_limb]
        parts = self._splitter.split(
            [s.blob for s in seen if not (self._is_known(s) or s.beside_limb)],
            frame, background.view.origin, _LEAST_PART * self._config.min_object_area,
        )  # fmt: skip
        whole += [detected(part, len(blob) > 1) for blob in parts for part in blob]
        assigned: dict[int, Assignment] = {}
        if whole and self._catalogue.objects:
            table = np.stack([s.probability for s in whole])
            if self._clipped:
                resting = [_resting(s) for s in whole]
                table = self._resting.remembered(frame.stamp, resting, table)
                whole = [s._replace(probability=p) for s, p in zip(whole, table, strict=True)]
            assigned = assign(table, least)
        named = {k: whole[m.blob]._replace(identity=m.probability) for k, m in assigned.items()}
        self._before = [np.sort(s.blob.pixels) for s in named.values()]
        taken = {match.blob for match in assigned.values()}
        return Detections(named, [s for b, s in enumerate(whole) if b not in taken], least)

    @property
    def _clipped(self) -> bool:
        return isinstance(self._catalogue, ClippedCatalogue)

    def _is_known(self, s: ObjectDetection) -> bool:
        return fits(s.probability, self._config.min_identity) is not None

    def _blobs(
        self, found: HandArmSegmentation, frame: RgbdFrame, background: Background
    ) -> list[Blob]:
        """Blobs of one object each as far as colours tell: split and merged by them."""
        c, catalogue = self._config, self._catalogue
        limb = len(found.hand) > 0 or len(found.arm) > 0
        least = c.min_object_area / 4 if limb else c.min_object_area
        blobs = [p for b in found.objects for p in top_view_parts(b, c.cell_size, least)]
        if not catalogue.objects:
            return blobs
        if limb:
            blobs += detect_in_depth_shadow(frame, background, catalogue, least)
        if self._clipped:
            # Lit and shaded parts of one may have the clipped colours of two.
            return merge_parts(blobs, catalogue)
        width = frame.depth.shape[1]
        apart = [
            p for blob in blobs for p in split_by_colour(blob, width, catalogue, self._before)
        ]
        return merge_parts(apart, catalogue)

    def _detected(
        self, blob: Blob, beside: bool, part: bool, frame: RgbdFrame, background: Background
    ) -> ObjectDetection:
        """Shape and identity of a blob; part: it may stand on another one."""
        catalogue = self._catalogue
        shape = correct_self_occlusion(shape_of(blob), background.view.origin)
        longest = 0.0 if part else _POSES * catalogue.longest
        standing = stands_on_table(blob, self._config.fallen_depth, longest)
        seen = shape if standing else replace(shape, height=np.nan)
        probability = identity_probability(catalogue, blob.bins, seen, not beside)
        fits_none = not beside and probability.argmax() == len(catalogue.objects)
        if fits_none and catalogue.objects and partly_hidden(blob, frame):
            probability = identity_probability(catalogue, blob.bins, seen, whole=False)
        return ObjectDetection(blob, shape, 0.0, beside, probability)


def _resting(s: ObjectDetection) -> Resting:
    return Resting(s.shape.centroid[:2], s.blob.area, s.beside_limb)


def is_on_table(s: ObjectDetection, config: PerceptionConfig, background: Background) -> bool:
    """Whether a blob without a name is an object on the table.

    Excludes small blobs, noise of the plane and the room beside and below the table.
    """
    low = s.shape.centroid[2] < -config.fallen_depth
    least = max(1.5 * config.min_height, _LEAST_HEIGHT * background.roughness)
    flat = s.shape.height < least
    return s.blob.area >= config.min_object_area and not (s.beside_limb or low or flat)

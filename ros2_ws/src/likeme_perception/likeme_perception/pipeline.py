"""Perception pipeline: from an RGB-D frame to a TableObservation, without ROS."""

from __future__ import annotations

from dataclasses import replace
from typing import cast

import cv2
import numpy as np
from numpy.typing import NDArray

from likeme_core.regions import Regions
from likeme_perception.background import Background, BackgroundLearner
from likeme_perception.blobs import Blob, Index, mask_of
from likeme_perception.catalogue import Catalogue, ObjectSample
from likeme_perception.config import PerceptionConfig
from likeme_perception.demonstration_tracking import DemonstrationTracker
from likeme_perception.depth_shadow import detect_in_depth_shadow
from likeme_perception.errors import NoDepthError
from likeme_perception.hand_arm_segmentation import HandArmSegmentation, HandArmSegmenter
from likeme_perception.identification import Assignment, assign, identity_probability
from likeme_perception.object_track import FrameContext, ObjectDetection, ObjectTrack
from likeme_perception.observation import TableObservation, UnresolvedReason
from likeme_perception.rgbd import Intrinsics, RgbdFrame
from likeme_perception.state_probability import regions_of
from likeme_perception.static_foreground import AbsorbedRegion, StaticForegroundDetector, absorb
from likeme_perception.top_view import Shape, correct_self_occlusion, shape_of, top_view_parts
from likeme_perception.touching_objects import merge_parts, split_by_colour

ImageB = NDArray[np.uint8]

# Neighbourhood (pixels) of a limb in which an object counts as touching or partly occluded.
_BESIDE = np.ones((9, 9), np.uint8)


class TabletopPerception:
    """Learns the background from the first frames and observes the table in all later ones.

    All times are stamps of frames; no clock is read. "Limb" stands for a hand or an arm.

    Attributes:
        background: None until it is learned.
        absorbed_count: how many limbs were absorbed into the background.
    """

    def __init__(
        self, config: PerceptionConfig, intrinsics: Intrinsics, catalogue: Catalogue
    ) -> None:
        self.config = config
        self.intrinsics = intrinsics
        self.catalogue = catalogue
        self.background: Background | None = None
        self._learner = BackgroundLearner(config, intrinsics)
        known = catalogue.best_log_density if catalogue.objects else None
        self._segmenter = HandArmSegmenter(config, known)
        self._static = StaticForegroundDetector(config.still_time)
        # Limbs that did not move; part of the background until they move.
        self._absorbed: tuple[AbsorbedRegion, ...] = ()
        self.absorbed_count = 0
        self.reset_tracking()

    def reset_tracking(self) -> None:
        """Reset the tracks and the act in progress; the background is kept."""
        self._tracks = [ObjectTrack(known, self.config) for known in self.catalogue.objects]
        self.demonstrations = DemonstrationTracker(self.config)

    @property
    def restarts(self) -> int:
        """How often learning of the background was restarted because something moved."""
        return self._learner.restarts

    @property
    def regions(self) -> Regions | None:
        """The regions that define the states; None until the background is learned."""
        return None if self.background is None else regions_of(self.config, self.background.area)

    def described(self) -> dict[str, str]:
        """Counts for the diagnostics."""
        return {
            'background restarts': str(self.restarts),
            'still hands or arms made background': str(self.absorbed_count),
        } | {
            f'acts not understood: {reason}': str(self.demonstrations.unresolved[reason])
            for reason in UnresolvedReason
        }

    def process(self, frame: RgbdFrame) -> TableObservation:
        """Process one frame.

        Raises:
            ValueError: the frame's size is not that of the intrinsics, or it has no depth.
        """
        if frame.depth.shape != self.intrinsics.shape:
            raise ValueError(
                f'Expected an image of {self.intrinsics.height}x{self.intrinsics.width}, '
                f'got {frame.depth.shape[0]}x{frame.depth.shape[1]}.'
            )
        if self.background is None:
            if not frame.has_depth:
                raise NoDepthError(f'Expected depth readings, got 0 of {frame.depth.size}.')
            self.background = self._learner.add(frame)
            if self.background is None:
                return TableObservation(frame.stamp, frame.frame_id, learned=False)
        self.background = self._restore_background(frame, self.background)
        return self._read(frame, self.background)

    def largest_unknown(self, frame: RgbdFrame, table: TableObservation) -> ObjectSample | None:
        """The largest object in a processed frame that is not in the catalogue; None: none."""
        if not table.unknown_objects or self.background is None:
            return None
        pixels, shape = max(table.unknown_objects, key=lambda each: len(each[0]))
        area = self.background.view.pixel_area(frame.depth.ravel()[pixels]).sum()
        return ObjectSample(frame.rgb.reshape(-1, 3)[pixels], shape, float(area))

    def _restore_background(self, frame: RgbdFrame, background: Background) -> Background:
        """The background without the absorbed limbs that have moved."""
        left = {region for region in self._absorbed if region.has_left(frame)}
        for region in reversed(self._absorbed):
            if region in left:
                background = region.removed_from(background)
        self._absorbed = tuple(region for region in self._absorbed if region not in left)
        return background

    def _read(self, frame: RgbdFrame, background: Background) -> TableObservation:
        foreground = background.foreground(frame)
        found = self._segmenter.segment(frame, foreground, background, self._protected(frame))
        limb = np.concatenate([found.hand, found.arm])
        if self._static.update(frame.stamp, limb, frame.depth.size):
            self.background, region = absorb(background, frame, limb)
            self._absorbed = (*self._absorbed, region)
            self.absorbed_count += 1
        hand = found.hand_area > self.config.intruder_min_area
        arm = found.arm_area > self.config.intruder_min_area
        limb_mask = _dilated_mask(limb, frame.depth.shape)
        blobs = self._blobs(found, frame)
        detections, unknown = self._identified(blobs, limb_mask if hand or arm else None)
        regions = regions_of(self.config, background.area)
        context = FrameContext(
            hand, arm, limb_mask, self._absorbed_mask(frame), background.view, regions
        )
        objects = tuple(
            track.update(frame, detections.get(k), context) for k, track in enumerate(self._tracks)
        )
        settled = not hand and not arm and all(o.settled for o in objects)
        now = TableObservation(
            frame.stamp, frame.frame_id, True, hand, arm, settled, objects,
            hand_tip=found.tip if hand else None, hand=found.hand, arm=found.arm,
            unknown_objects=unknown,
        )  # fmt: skip
        acts = self.demonstrations.update(now)
        return replace(now, demonstrations=acts.demonstrations, unresolved=acts.unresolved)

    def _protected(self, frame: RgbdFrame) -> ImageB:
        """Mask of the objects at rest that have not changed, (H, W) 0 or 1."""
        kept = [track.unchanged(frame) for track in self._tracks]
        return mask_of(np.concatenate([np.zeros(0, np.intp), *kept]), frame.depth.shape)

    def _absorbed_mask(self, frame: RgbdFrame) -> ImageB:
        """Mask of the absorbed limbs, (H, W) 0 or 1."""
        pixels = [region.pixels for region in self._absorbed]
        return mask_of(np.concatenate([np.zeros(0, np.intp), *pixels]), frame.depth.shape)

    def _blobs(self, found: HandArmSegmentation, frame: RgbdFrame) -> list[Blob]:
        """One blob per object: touching objects split, parts of one object merged."""
        c = self.config
        limb = len(found.hand) > 0 or len(found.arm) > 0
        least = c.min_object_area / 4 if limb else c.min_object_area
        blobs = [p for b in found.objects for p in top_view_parts(b, c.cell_size, least)]
        if not self.catalogue.objects:
            return blobs
        if limb and self.background is not None:
            blobs += detect_in_depth_shadow(frame, self.background, self.catalogue, least)
        width = frame.depth.shape[1]
        apart = [p for blob in blobs for p in split_by_colour(blob, width, self.catalogue)]
        return merge_parts(apart, self.catalogue)

    def _identified(
        self, blobs: list[Blob], limb_mask: ImageB | None
    ) -> tuple[dict[int, ObjectDetection], tuple[tuple[NDArray[np.intp], Shape], ...]]:
        """Detections by catalogue index, and unknown objects."""
        camera = cast(Background, self.background).view.origin
        seen = [_detection(blob, limb_mask, camera) for blob in blobs]
        assigned: dict[int, Assignment] = {}
        if seen and self.catalogue.objects:
            table = np.stack([self._probability(s) for s in seen])
            assigned = assign(table, self.config.min_identity)
        named = {
            k: seen[match.blob]._replace(identity=match.probability)
            for k, match in assigned.items()
        }
        taken = {match.blob for match in assigned.values()}
        rest = [s for b, s in enumerate(seen) if b not in taken]
        return named, tuple((s.blob.pixels, s.shape) for s in rest if self._is_unknown_object(s))

    def _is_unknown_object(self, s: ObjectDetection) -> bool:
        """Whether an unidentified blob is an object on the table.

        Excludes small blobs, noise of the plane and the room beside and below the table.
        """
        c = self.config
        risen = s.shape.height >= 1.5 * c.min_height and s.shape.centroid[2] >= -c.fallen_depth
        return s.blob.area >= c.min_object_area and not s.beside_limb and risen

    def _probability(self, s: ObjectDetection) -> NDArray[np.float64]:
        shape = None if s.beside_limb else s.shape
        return identity_probability(self.catalogue, s.blob.bins, shape)


def _detection(
    blob: Blob, limb_mask: ImageB | None, camera: NDArray[np.float32]
) -> ObjectDetection:
    beside = limb_mask is not None and bool(limb_mask.take(blob.pixels).any())
    shape = correct_self_occlusion(shape_of(blob), camera)
    return ObjectDetection(blob, shape, 0.0, beside)


def _dilated_mask(limb: Index, shape: tuple[int, int]) -> ImageB:
    """The pixels of hand and arm (flat indices) as a dilated mask, (H, W) 0 or 1."""
    mask = mask_of(limb, shape)
    return cast(ImageB, cv2.dilate(mask, _BESIDE)) if len(limb) else mask

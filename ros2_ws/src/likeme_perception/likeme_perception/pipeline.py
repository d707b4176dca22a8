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
from likeme_perception.demonstration_tracking import CompletedActs, DemonstrationTracker
from likeme_perception.depth_holes import with_holes_filled
from likeme_perception.depth_shadow import detect_in_depth_shadow
from likeme_perception.errors import NoDepthError
from likeme_perception.hand_arm_segmentation import HandArmSegmentation, HandArmSegmenter
from likeme_perception.identification import (
    Assignment,
    alike_in_colour,
    alike_in_size,
    assign,
    identity_probability,
)
from likeme_perception.light import Light, Rgb, as_taught, light_of, table_colour
from likeme_perception.object_track import FrameContext, ObjectDetection, ObjectTrack
from likeme_perception.observation import TableObservation, UnresolvedReason
from likeme_perception.rgbd import Intrinsics, RgbdFrame
from likeme_perception.state_probability import regions_of
from likeme_perception.static_foreground import (
    AbsorbedRegion,
    StaticForegroundDetector,
    absorb,
    covered_region,
)
from likeme_perception.table_check import CAMERA_MOVED, DEPTH_MISSING, TableCheck
from likeme_perception.top_view import correct_self_occlusion, shape_of, top_view_parts
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
        self._check: TableCheck | None = None
        self._table_colour = config.table_colour
        self._last: TableObservation | None = None
        self._confusable: set[int] = set()
        self.reset_tracking()

    def reset_tracking(self) -> None:
        """Reset the tracks and the act in progress; the background is kept."""
        self._tracks = [ObjectTrack(known, self.config) for known in self.catalogue.objects]
        self.demonstrations = DemonstrationTracker(self.config)

    @property
    def reason(self) -> str:
        """Why the last frame told nothing; empty if it was read."""
        return '' if self._last is None else self._last.reason

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
            'states unknown because': self.reason,
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
            self.background = self._learned(self.background)
        if self._check is None:
            # The background was given: it shows the taught colours.
            self._check = TableCheck(self.background)
        frame, light = self._checked(frame, self._check)
        if light.reason:
            self._last = self._unread(frame, self.background, light.reason)
            return self._last
        self.background = self._restore_background(frame, self.background)
        self._last = self._read(frame, self.background, light)
        return self._last

    def _learned(self, background: Background) -> Background:
        """The new background in the taught colours; what a hand covers of it, as absorbed."""
        self._check = check = TableCheck(background)
        if check.enough and self._table_colour is None:
            self._table_colour = table_colour(background.colour, check.pixels)
        if background.covered.any():
            self._absorbed = (covered_region(background),)
        light = self._light(background.colour, check, check.pixels)
        return replace(background, colour=as_taught(background.colour, light))

    def _light(self, rgb: ImageB, check: TableCheck, bare: Index) -> Light:
        """The light that the bare table shows; the taught one if there is nothing to compare."""
        if not check.enough or self._table_colour is None or not self.catalogue.objects:
            return Light((1.0, 1.0, 1.0))
        return light_of(table_colour(rgb, bare), self._table_colour)

    def _checked(self, frame: RgbdFrame, check: TableCheck) -> tuple[RgbdFrame, Light]:
        """The frame in the taught colours without single holes, and its light or why not."""
        light = self._light(frame.rgb, check, check.bare_now(frame))
        if check.camera_moved(frame):
            return frame, light._replace(reason=CAMERA_MOVED)
        if check.unread(frame):
            return frame, light._replace(reason=DEPTH_MISSING)
        if light.reason:
            return frame, light
        frame = with_holes_filled(frame)
        return replace(frame, rgb=as_taught(frame.rgb, light)), light

    def _unread(self, frame: RgbdFrame, background: Background, reason: str) -> TableObservation:
        """A frame that tells nothing; hand and arm are taken to be where they were."""
        regions, last = regions_of(self.config, background.area), self._last
        return TableObservation(
            frame.stamp, frame.frame_id, True,
            last is not None and last.hand_in_view, last is not None and last.arm_in_view,
            objects=tuple(track.unknown(regions) for track in self._tracks), reason=reason,
        )  # fmt: skip

    def bare_table_colour(self, frame: RgbdFrame) -> Rgb | None:
        """RGB of the table in a frame, for `table.colour` of a world file; None: not seen."""
        if self._check is None or not self._check.enough:
            return None
        return table_colour(frame.rgb, self._check.bare_now(frame))

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

    def _read(self, frame: RgbdFrame, background: Background, light: Light) -> TableObservation:
        foreground = background.foreground(frame)
        found = self._segmenter.segment(frame, foreground, background, self._protected(frame))
        limb = np.concatenate([found.hand, found.arm])
        still = self._static.update(frame.stamp, limb, frame.depth.size, found.detached)
        if still:
            self.background, region = absorb(background, frame, limb)
            self._absorbed = (*self._absorbed, region)
            self.absorbed_count += 1
        hand = found.hand_area > self.config.intruder_min_area
        arm = found.arm_area > self.config.intruder_min_area
        limb_mask = _dilated_mask(limb, frame.depth.shape)
        blobs = self._blobs(found, frame)
        detections, rest = self._identified(blobs, limb_mask if hand or arm else None)
        unknown = tuple((s.blob.pixels, s.shape) for s in rest if self._is_unknown_object(s))
        maybe = self._maybe_seen(rest, light)
        if len(limb) == 0:
            self._confusable = self._like_unknown_objects(rest)
        else:
            # A part of the other thing, beside the hand, has the size of the object.
            maybe |= self._confusable
            detections = {k: s for k, s in detections.items() if k not in self._confusable}
        regions = regions_of(self.config, background.area)
        absorbed = self._absorbed_mask(frame)
        context = FrameContext(
            hand, arm, limb_mask, absorbed, background.view, regions,
            lambda: background.table_seen(frame, absorbed),
        )  # fmt: skip
        objects = tuple(
            track.update(frame, detections.get(k), context, k in maybe)
            for k, track in enumerate(self._tracks)
        )
        settled = not hand and not arm and all(o.settled for o in objects)
        now = TableObservation(
            frame.stamp, frame.frame_id, True, hand, arm, settled, objects,
            hand_tip=found.tip if hand else None, hand=found.hand, arm=found.arm,
            unknown_objects=unknown,
        )  # fmt: skip
        acts = self._acts(now, still)
        return replace(now, demonstrations=acts.demonstrations, unresolved=acts.unresolved)

    def _acts(self, now: TableObservation, still: bool) -> CompletedActs:
        """The acts that a frame completes; still: its hand or arm has become background."""
        if still and now.hand_in_view:
            return self.demonstrations.interrupt(now.stamp)
        return self.demonstrations.update(now)

    def _like_unknown_objects(self, rest: list[ObjectDetection]) -> set[int]:
        """Objects in whose colours something else is on the table, by catalogue index."""
        others = (s for s in rest if self._is_unknown_object(s))
        return {k for s in others for k in alike_in_colour(self.catalogue, s.blob.bins)}

    def _maybe_seen(self, rest: list[ObjectDetection], light: Light) -> set[int]:
        """Objects that one of the detections without a name may be, by catalogue index.

        Under a light that is not the taught one colours are less sure: then size alone counts.
        """
        maybe: set[int] = set()
        for s in rest:
            maybe |= alike_in_colour(self.catalogue, s.blob.bins)
            if not light.usual and self._is_unknown_object(s):
                maybe |= alike_in_size(self.catalogue, s.shape)
        return maybe

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
    ) -> tuple[dict[int, ObjectDetection], list[ObjectDetection]]:
        """Detections by catalogue index, and those without a name."""
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
        return named, [s for b, s in enumerate(seen) if b not in taken]

    def _is_unknown_object(self, s: ObjectDetection) -> bool:
        """Whether an unidentified blob is an object on the table.

        Excludes small blobs, noise of the plane and the room beside and below the table.
        """
        c = self.config
        risen = s.shape.height >= 1.5 * c.min_height and s.shape.centroid[2] >= -c.fallen_depth
        return s.blob.area >= c.min_object_area and not s.beside_limb and risen

    def _probability(self, s: ObjectDetection) -> NDArray[np.float64]:
        return identity_probability(self.catalogue, s.blob.bins, s.shape, not s.beside_limb)


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

"""Perception pipeline: from an RGB-D frame to a TableObservation, without ROS."""

from __future__ import annotations

from dataclasses import replace
from typing import cast

import cv2
import numpy as np
from numpy.typing import NDArray

from likeme_core.regions import Regions
from likeme_perception.background import Background, BackgroundLearner
from likeme_perception.blobs import Index, mask_of
from likeme_perception.catalogue import Catalogue, ClippedCatalogue, ObjectSample
from likeme_perception.colour import LogDensity
from likeme_perception.config import PerceptionConfig
from likeme_perception.demonstration_tracking import CompletedActs, DemonstrationTracker
from likeme_perception.depth_holes import with_holes_filled
from likeme_perception.errors import NoDepthError
from likeme_perception.hand_arm_segmentation import HandArmSegmenter
from likeme_perception.identification import alike_in_colour, alike_in_size, fits, possible
from likeme_perception.light import TAUGHT, Caps, Light, Rgb, as_taught, table_colour
from likeme_perception.light_estimation import LightEstimator
from likeme_perception.object_detection import ObjectDetection, ObjectDetector, is_on_table
from likeme_perception.object_track import FrameContext, ObjectTrack
from likeme_perception.observation import TableObservation, UnresolvedReason
from likeme_perception.rgbd import Intrinsics, RgbdFrame
from likeme_perception.same_kind import LostAmongSeveral, SameKindResolver
from likeme_perception.state_probability import regions_of
from likeme_perception.static_foreground import (
    AbsorbedRegion,
    StaticForegroundDetector,
    absorb,
    covered_region,
)
from likeme_perception.table_check import DEPTH_MISSING, TableCheck
from likeme_perception.unknown_objects import UnknownObject, UnknownObjectNames
from likeme_perception.unmoved_objects import keep_identities, lies_at

ImageB = NDArray[np.uint8]

#: Why the state of an object is unknown that cannot be told from another on the table.
TWO_OF_A_KIND = 'two of a kind'
# Neighbourhood (pixels) of a limb in which an object counts as touching or partly occluded.
_BESIDE = np.ones((9, 9), np.uint8)
# Looks of the objects under so many lights are kept.
_LIGHTS = 16


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
        self._looks: dict[Caps, Catalogue] = {}
        self._segmenter = HandArmSegmenter(config, _best_log_density(catalogue))
        self._static = StaticForegroundDetector(config.still_time)
        self._detector = ObjectDetector(config, catalogue)
        # Limbs that did not move; part of the background until they move.
        self._absorbed: tuple[AbsorbedRegion, ...] = ()
        self.absorbed_count = 0
        self._check: TableCheck | None = None
        places = config.world.table.dark if config.world else ()
        self._lights = LightEstimator(config.table_colour, places)
        self._last: TableObservation | None = None
        self._confusable: set[int] = set()
        self.reset_tracking()

    def reset_tracking(self) -> None:
        """Reset the tracks and the act in progress; the background is kept."""
        self._tracks = [ObjectTrack(known, self.config) for known in self.catalogue.objects]
        self.demonstrations = DemonstrationTracker(self.config)
        self._same_kind = SameKindResolver(self.config.settle_time)
        self._names = UnknownObjectNames(self.config.absence_time)
        self._lost = LostAmongSeveral()

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
            self._lights.given(self.background)
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
        if background.covered.any():
            self._absorbed = (covered_region(background),)
        return self._lights.learned(background, check) if self.catalogue.objects else background

    def _light(self, frame: RgbdFrame, check: TableCheck) -> Light:
        """The light on a frame; the taught one if there are no colours to compare."""
        if not self.catalogue.objects:
            return TAUGHT
        return self._lights.light(frame, check)

    def _looks_under(self, light: Light) -> Catalogue:
        """The known objects as they look in the colours of a frame."""
        if not light.clipped:
            return self.catalogue
        if light.caps not in self._looks:
            self._looks = {} if len(self._looks) >= _LIGHTS else self._looks
            self._looks[light.caps] = ClippedCatalogue(self.catalogue.objects, light.caps)
        return self._looks[light.caps]

    def _checked(self, frame: RgbdFrame, check: TableCheck) -> tuple[RgbdFrame, Light]:
        """The frame in the taught colours without single holes, and its light or why not."""
        light = self._light(frame, check)
        misfit = check.misfit(frame, lit=not light.reason)
        if misfit:
            return frame, light._replace(reason=misfit)
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
            objects=tuple(track.unknown(regions, reason) for track in self._tracks), reason=reason,
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
        largest = max(table.unknown_objects, key=lambda each: len(each.pixels))
        area = self.background.view.pixel_area(frame.depth.ravel()[largest.pixels]).sum()
        return ObjectSample(frame.rgb.reshape(-1, 3)[largest.pixels], largest.shape, float(area))

    def _restore_background(self, frame: RgbdFrame, background: Background) -> Background:
        """The background without the absorbed limbs that have moved."""
        left = {region for region in self._absorbed if region.has_left(frame)}
        for region in reversed(self._absorbed):
            if region in left:
                background = region.removed_from(background)
        self._absorbed = tuple(region for region in self._absorbed if region not in left)
        return background

    def _read(self, frame: RgbdFrame, background: Background, light: Light) -> TableObservation:
        looks, foreground = self._looks_under(light), background.foreground(frame)
        self._segmenter.compare_with(_best_log_density(looks))
        unchanged = [track.unchanged(frame) for track in self._tracks]
        found = self._segmenter.segment(
            frame, foreground, _clipped(background, light), _mask_of_all(unchanged, frame)
        )
        limb = np.concatenate([found.hand, found.arm])
        still = self._static.update(frame.stamp, limb, frame.depth.size, found.detached)
        if still:
            self.background, region = absorb(background, frame, limb)
            self._absorbed = (*self._absorbed, region)
            self.absorbed_count += 1
        hand = found.hand_area > self.config.intruder_min_area
        arm = found.arm_area > self.config.intruder_min_area
        limb_mask = _dilated_mask(limb, frame.depth.shape)
        seen = self._detector.detect(
            found, limb_mask if hand or arm else None, frame, background, looks
        )
        unmoved = [track.unmoved(frame, len(limb) > 0) for track in self._tracks]
        seen, contested = keep_identities(seen, {k: u for k, u in enumerate(unmoved) if u})
        (detections, rest, _), unclear = self._same_kind.resolved(frame.stamp, seen, len(limb) > 0)
        unclear |= self._lost.update(detections, rest, light.clipped, len(limb) > 0)
        maybe = contested | self._maybe_seen(rest, light, looks)
        if light.clipped:
            maybe |= {k for s in [*detections.values(), *rest] for k in possible(s.probability)}
        if len(limb) == 0:
            self._confusable = self._like_unknown_objects(rest, looks)
        else:
            # A part of the other thing, beside the hand, has the size of the object.
            maybe |= self._confusable
            detections = {k: s for k, s in detections.items() if k not in self._confusable}
        regions = regions_of(self.config, background.area)
        absorbed = _mask_of_all([region.pixels for region in self._absorbed], frame)
        context = FrameContext(
            hand, arm, limb_mask, absorbed, background.view, regions,
            lambda: background.table_seen(frame, absorbed), light.clipped,
        )  # fmt: skip
        objects = tuple(
            track.unknown(regions, TWO_OF_A_KIND)
            if k in unclear
            else track.update(frame, detections.get(k), context, k in maybe)
            for k, track in enumerate(self._tracks)
        )
        unknown = self._named(rest, frame.stamp, len(limb) > 0, unclear)
        settled = not hand and not arm and all(o.settled for o in objects)
        now = TableObservation(
            frame.stamp, frame.frame_id, True, hand, arm, settled, objects,
            hand_tip=found.tip if hand else None, hand=found.hand, arm=found.arm,
            unknown_objects=unknown,
        )  # fmt: skip
        acts = self._acts(now, still)
        return replace(
            now, demonstrations=acts.demonstrations, unresolved=acts.unresolved,
            attempts=acts.attempts,
        )  # fmt: skip

    def _acts(self, now: TableObservation, still: bool) -> CompletedActs:
        """What a frame tells of acts; still: its hand or arm has become background."""
        if still and now.hand_in_view:
            return self.demonstrations.interrupt(now.stamp)
        return self.demonstrations.update(now)

    def _like_unknown_objects(self, rest: list[ObjectDetection], looks: Catalogue) -> set[int]:
        """Objects in whose colours something else is on the table, by catalogue index."""
        others = (s for s in rest if self._on_table(s))
        return {k for s in others for k in alike_in_colour(looks, s.blob.bins)}

    def _named(
        self, rest: list[ObjectDetection], stamp: int, limb: bool, unclear: set[int]
    ) -> tuple[UnknownObject, ...]:
        """What is on the table without a name of the catalogue; unclear: two of a kind are."""
        known = [o.name for o in self.catalogue.objects]
        found = [
            UnknownObject('', self._fits(s), float(s.probability[-1]), s.blob.pixels, s.shape)
            for s in rest
            if self._on_table(s)
        ]
        told = frozenset(name for k, name in enumerate(known) if k not in unclear)
        return self._names.named(found, stamp, limb, told)

    def _on_table(self, s: ObjectDetection) -> bool:
        return is_on_table(s, self.config, cast(Background, self.background))

    def _fits(self, s: ObjectDetection) -> str:
        """Name of the object that a detection fits; empty if it fits none."""
        k = fits(s.probability, self.config.min_identity)
        return '' if k is None else self.catalogue.objects[k].name

    def _maybe_seen(self, rest: list[ObjectDetection], light: Light, looks: Catalogue) -> set[int]:
        """Objects that one of the detections without a name may be, by catalogue index.

        Under a light that is not the taught one colours are less sure: then size alone counts.
        What lies where an object lay may be that object in any light.
        """
        maybe: set[int] = set()
        for s in rest:
            maybe |= alike_in_colour(looks, s.blob.bins)
            if not self._on_table(s):
                continue
            if not light.usual:
                maybe |= alike_in_size(self.catalogue, s.shape)
            maybe |= {k for k, t in enumerate(self._tracks) if lies_at(s, t.place, t.known.length)}
        return maybe


def _best_log_density(catalogue: Catalogue) -> LogDensity | None:
    return catalogue.best_log_density if catalogue.objects else None


def _clipped(background: Background, light: Light) -> Background:
    """The background in the colours of a frame under a light."""
    if not light.clipped:
        return background
    return replace(
        background, colour=np.minimum(background.colour, np.array(light.caps, np.uint8))
    )


def _mask_of_all(pixels: list[Index], frame: RgbdFrame) -> ImageB:
    """Mask of some sets of pixels (flat indices), (H, W) 0 or 1."""
    return mask_of(np.concatenate([np.zeros(0, np.intp), *pixels]), frame.depth.shape)


def _dilated_mask(limb: Index, shape: tuple[int, int]) -> ImageB:
    """The pixels of hand and arm (flat indices) as a dilated mask, (H, W) 0 or 1."""
    mask = mask_of(limb, shape)
    return cast(ImageB, cv2.dilate(mask, _BESIDE)) if len(limb) else mask

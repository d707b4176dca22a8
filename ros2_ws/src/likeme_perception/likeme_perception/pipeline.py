"""Frame in, table out: the whole of perception as one stateful object without ROS."""

from __future__ import annotations

from dataclasses import replace
from typing import cast

import cv2
import numpy as np
from numpy.typing import NDArray

from likeme_core.regions import Regions
from likeme_perception.background import Background, BackgroundLearner
from likeme_perception.config import PerceptionConfig
from likeme_perception.errors import NoDepthError
from likeme_perception.hand import Intruders, IntruderSegmenter
from likeme_perception.identification import Catalogue, Match, assign, identity_probability
from likeme_perception.objects import ObjectTrack, Scene, Sighting
from likeme_perception.observation import TableObservation
from likeme_perception.regions import regions_of
from likeme_perception.rgbd import Intrinsics, RgbdFrame
from likeme_perception.segmentation import (
    Blob,
    Index,
    Shape,
    completed,
    mask_of,
    shape_of,
    top_view_parts,
)
from likeme_perception.shadow import shadowed_things
from likeme_perception.stillness import StillnessWatch, StillThing, absorbed
from likeme_perception.touching import parts_by_colour, pieces_joined
from likeme_perception.tracking import DemonstrationTracker

ImageB = NDArray[np.uint8]

# Pixels about a hand or an arm in which an object counts as touching or partly hidden.
_BESIDE = np.ones((9, 9), np.uint8)


class TabletopPerception:
    """Learns the background from the first frames, then says what is where in every further one.

    process() never looks at a clock: all times are the frames' stamps.
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
        self._intruders = IntruderSegmenter(config, known)
        self._still = StillnessWatch(config.still_time)
        # What reached in and stayed, and is background for as long as it does not move.
        self._absorbed: tuple[StillThing, ...] = ()
        self.absorbed = 0
        self.reset_tracking()

    def reset_tracking(self) -> None:
        """Forget all objects and the act in progress; the background stays."""
        self._tracks = [ObjectTrack(known, self.config) for known in self.catalogue.objects]
        self.demonstrations = DemonstrationTracker(self.config)

    @property
    def restarts(self) -> int:
        """How often the background had to be learned anew because something moved."""
        return self._learner.restarts

    @property
    def regions(self) -> Regions | None:
        """The areas that define the states, once the table is known."""
        return None if self.background is None else regions_of(self.config, self.background.area)

    def described(self) -> dict[str, str]:
        """What happened so far that those who look after it may want to know."""
        return {
            'background restarts': str(self.restarts),
            'still intruders made background': str(self.absorbed),
            'acts with hand and arm at once': str(self.demonstrations.shared_acts),
        }

    def process(self, frame: RgbdFrame) -> TableObservation:
        """Read one frame.

        Raises:
            ValueError: the frame's size is not that of the intrinsics, or it has no depth at all.
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
        self.background = self._without_those_who_left(frame, self.background)
        return self._read(frame, self.background)

    def _without_those_who_left(self, frame: RgbdFrame, background: Background) -> Background:
        left = {thing for thing in self._absorbed if thing.has_left(frame)}
        for thing in reversed(self._absorbed):
            if thing in left:
                background = thing.removed_from(background)
        self._absorbed = tuple(thing for thing in self._absorbed if thing not in left)
        return background

    def _read(self, frame: RgbdFrame, background: Background) -> TableObservation:
        foreground = background.foreground(frame)
        found = self._intruders.segment(frame, foreground, background, self._protected(frame))
        intruder = np.concatenate([found.hand, found.arm])
        if self._still.still(frame.stamp, intruder, frame.depth.size):
            self.background, still = absorbed(background, frame, intruder)
            self._absorbed, self.absorbed = (*self._absorbed, still), self.absorbed + 1
        hand = found.hand_area > self.config.intruder_min_area
        arm = found.arm_area > self.config.intruder_min_area
        hiding = _hiding(intruder, frame.depth.shape)
        blobs = self._blobs(found, frame)
        sightings, things = self._named(blobs, hiding if hand or arm else None)
        regions = regions_of(self.config, background.area)
        scene = Scene(hand, arm, hiding, self._parked(frame), background.view, regions)
        objects = tuple(
            track.update(frame, sightings.get(k), scene) for k, track in enumerate(self._tracks)
        )
        settled = not hand and not arm and all(o.settled for o in objects)
        now = TableObservation(
            frame.stamp, frame.frame_id, True, hand, arm, settled, objects, (),
            found.tip if hand else None, found.hand, found.arm, things,
        )  # fmt: skip
        return replace(now, demonstrations=self.demonstrations.update(now))

    def _protected(self, frame: RgbdFrame) -> ImageB:
        """Pixels in which a resting object still is where it was, (H, W) 0 or 1."""
        kept = [track.unchanged(frame) for track in self._tracks]
        return mask_of(np.concatenate([np.zeros(0, np.intp), *kept]), frame.depth.shape)

    def _parked(self, frame: RgbdFrame) -> ImageB:
        """Pixels of what reached in and stayed, (H, W) 0 or 1."""
        pixels = [still.pixels for still in self._absorbed]
        return mask_of(np.concatenate([np.zeros(0, np.intp), *pixels]), frame.depth.shape)

    def _blobs(self, found: Intruders, frame: RgbdFrame) -> list[Blob]:
        """Things apart from each other, pieces of one thing together."""
        c = self.config
        intruder = len(found.hand) > 0 or len(found.arm) > 0
        least = c.min_object_area / 4 if intruder else c.min_object_area
        blobs = [p for t in found.things for p in top_view_parts(t, c.cell_size, least)]
        if not self.catalogue.objects:
            return blobs
        if intruder and self.background is not None:
            blobs += shadowed_things(frame, self.background, self.catalogue, least)
        width = frame.depth.shape[1]
        apart = [p for blob in blobs for p in parts_by_colour(blob, width, self.catalogue)]
        return pieces_joined(apart, self.catalogue)

    def _named(
        self, blobs: list[Blob], hiding: ImageB | None
    ) -> tuple[dict[int, Sighting], tuple[tuple[NDArray[np.intp], Shape], ...]]:
        """Sightings by catalogue index, and what is none of the known things."""
        camera = cast(Background, self.background).view.origin
        seen = [_sighting(blob, hiding, camera) for blob in blobs]
        matches: dict[int, Match] = {}
        if seen and self.catalogue.objects:
            table = np.stack([self._probability(s) for s in seen])
            matches = assign(table, self.config.min_identity)
        named = {
            k: seen[match.blob]._replace(identity=match.probability)
            for k, match in matches.items()
        }
        taken = {match.blob for match in matches.values()}
        rest = [s for b, s in enumerate(seen) if b not in taken]
        return named, tuple((s.blob.pixels, s.shape) for s in rest if self._is_thing(s))

    def _is_thing(self, s: Sighting) -> bool:
        """Whether pixels in no catalogue are worth a word.

        No speck, no ripple of the plane, and nothing that is not on the table: what is seen beside
        and below it is the room.
        """
        c = self.config
        risen = s.shape.height >= 1.5 * c.min_height and s.shape.centroid[2] >= -c.fallen_depth
        return s.blob.area >= c.min_object_area and not s.beside_intruder and risen

    def _probability(self, s: Sighting) -> NDArray[np.float64]:
        shape = None if s.beside_intruder else s.shape
        return identity_probability(self.catalogue, s.blob.bins, shape)


def _sighting(blob: Blob, hiding: ImageB | None, camera: NDArray[np.float32]) -> Sighting:
    beside = hiding is not None and bool(hiding.take(blob.pixels).any())
    shape = completed(shape_of(blob), camera)
    return Sighting(blob, shape, 0.0, beside)


def _hiding(intruder: Index, shape: tuple[int, int]) -> ImageB:
    """The pixels of hand and arm (flat indices), grown by a few pixels, (H, W) 0 or 1."""
    mask = mask_of(intruder, shape)
    return cast(ImageB, cv2.dilate(mask, _BESIDE)) if len(intruder) else mask

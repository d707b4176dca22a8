"""Track of one object: position, rest, and state while it is not visible."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from likeme_core.regions import Regions
from likeme_core.stamps import nanoseconds, seconds
from likeme_core.tabletop import State
from likeme_perception.blobs import Index
from likeme_perception.camera_view import CameraView
from likeme_perception.catalogue import CatalogueObject
from likeme_perception.config import PerceptionConfig
from likeme_perception.object_detection import ObjectDetection
from likeme_perception.observation import ObjectObservation
from likeme_perception.occlusion_correction import correct_occluded_shape
from likeme_perception.rgbd import RgbdFrame, depth_sigma
from likeme_perception.rise_estimation import horizontal_distance
from likeme_perception.state_probability import certain, state_probability
from likeme_perception.top_view import Shape
from likeme_perception.unmoved_objects import Unmoved

ImageF = NDArray[np.float32]

# Below this share of its usual area an object beside a limb counts as partly occluded.
_WHOLE_FRACTION = 0.85
# Step of the moving average of the usual area.
_AREA_STEP = 0.05
# The place of an object at rest is unchanged if this share of its readings is; it is hidden if
# less than the second share of its pixels has one.
_UNCHANGED, _READ = 0.8, 0.5
# Colours and depth may be so far (s) apart in time: what moves is where it is no surer than that.
_OUT_OF_STEP = 0.1
# An identity that is at least so sure leaves the state's probability as it is; so does that of
# what rests, which was told in many frames.
_SURE_IDENTITY = 0.99
# Probability that what was only seen in part, in the colours of an object, is that object.
_SURE_BY_PART = 0.5
# An object is held if its top is this much (m) higher than it can stand; the neighbourhood
# (pixels) in which a hand touches it.
_RAISED, _TOUCH = 0.03, np.ones((15, 15), np.uint8)


class FrameContext(NamedTuple):
    """What a track needs to know of the rest of the frame.

    hand, arm: whether they are in view. limb_mask: their pixels, dilated, (H, W). absorbed_mask:
    pixels of limbs that were absorbed into the background, (H, W). table_seen: whether no part of
    the table that could hide an object went unread. doubtful: whether identities are; states are
    then no surer than they.
    """

    hand: bool
    arm: bool
    limb_mask: NDArray[np.uint8]
    absorbed_mask: NDArray[np.uint8]
    view: CameraView
    regions: Regions
    table_seen: Callable[[], bool]
    doubtful: bool = False

    @property
    def limb_in_view(self) -> bool:
        """Whether a hand or an arm is in view, which may hide or hold an object."""
        return self.hand or self.arm

    def hidden_by_absorbed(self, place: tuple[float, float, float]) -> bool:
        """Whether an absorbed limb covers a point (m) in the image."""
        if not np.isfinite(place).all():
            return False
        column, row = (int(v) for v in np.rint(self.view.project(np.array([place]))[0]))
        height, width = self.absorbed_mask.shape
        return 0 <= row < height and 0 <= column < width and bool(self.absorbed_mask[row, column])


class Template(NamedTuple):
    """An object at rest as it was last seen without occlusion: pixels, depths (m), shape.

    identity: probability that it is that object.
    """

    pixels: Index
    depth: ImageF
    shape: Shape
    identity: float

    def unchanged(self, frame: RgbdFrame) -> Index:
        """Pixels in which the depth has not changed."""
        now = frame.depth.ravel()[self.pixels]
        near = np.abs(now - self.depth) < 0.005 + 3 * depth_sigma(self.depth)
        return np.asarray(self.pixels[near])


class ObjectTrack:
    """Tracks one object of the catalogue over successive frames."""

    def __init__(self, known: CatalogueObject, config: PerceptionConfig) -> None:
        self.known = known
        self._config = config
        self._usual_area = known.area
        self._usual_shape = Shape((0.0, 0.0, 0.0), 0.0, known.length, known.width, known.height)
        self._last = ObjectObservation(known.name)
        self._anchor: tuple[float, float] | None = None
        self._rest_since = 0
        self._unseen_since: int | None = None
        self._template: Template | None = None
        # The last template, also if it was not seen since, until it is seen elsewhere or a hand or
        # an arm has hidden or moved it.
        self._identified: Template | None = None
        # It was elsewhere, and then a hand came.
        self._brought = False
        # It was seen whole since it was elsewhere.
        self._seen_whole = False

    @property
    def place(self) -> tuple[float, float, float]:
        """Centroid as last seen, m; NaN if never seen."""
        return self._last.centroid

    def unchanged(self, frame: RgbdFrame) -> Index:
        """Pixels in which the object at rest has not changed its depth since the template."""
        if self._template is None:
            return np.zeros(0, np.intp)
        return self._template.unchanged(frame)

    def unmoved(self, frame: RgbdFrame, limb: bool) -> Unmoved | None:
        """The object at rest if its surface is the one that was identified; None if it may not be.

        limb: whether a hand or an arm is in view.
        """
        known = self._identified
        if known is None:
            return None
        unchanged = known.unchanged(frame)
        read = np.count_nonzero(np.isfinite(frame.depth.take(known.pixels)))
        if read < _READ * len(known.pixels) or len(unchanged) < _UNCHANGED * read:
            self._identified = None if limb else known
            return None
        return Unmoved(unchanged, known.shape, self._usual_area, known.identity)

    def update(
        self,
        frame: RgbdFrame,
        detection: ObjectDetection | None,
        context: FrameContext,
        maybe_seen: bool = False,
    ) -> ObjectObservation:
        """Process one frame.

        detection: None if the object was not detected; maybe_seen: something that was not
        identified may be it.
        """
        fraction = 0.0 if detection is None else min(1.0, detection.blob.area / self._usual_area)
        if detection is not None and fraction >= self._config.visible_fraction:
            self._last = self._seen(frame, detection, fraction, context)
            return self._last
        seen = self._unseen(frame.stamp, context, maybe_seen)
        if self._last.state != context.regions.elsewhere or seen.state is not None:
            self._last = seen
        return seen

    def unknown(self, regions: Regions, reason: str) -> ObjectObservation:
        """The object in a frame that cannot be read; the track stays as it is."""
        return _unknown(self._last, reason, regions)

    def _seen(
        self, frame: RgbdFrame, s: ObjectDetection, fraction: float, context: FrameContext
    ) -> ObjectObservation:
        self._unseen_since, self._brought = None, False
        partial = context.limb_in_view and (fraction < _WHOLE_FRACTION or s.beside_limb)
        shape, sigma = s.shape, self._config.centroid_sigma
        if partial:
            shape, sigma = self._partly_seen(frame, s, fraction, context)
        held = self._held_by_absorbed(s, context)
        resting = self._at_rest(frame.stamp, shape) and not held
        if not context.limb_in_view:
            self._usual_area += _AREA_STEP * (s.blob.area - self._usual_area)
        if resting and not partial:
            depth = frame.depth.ravel()[s.blob.pixels]
            self._template = Template(s.blob.pixels, depth, shape, s.identity)
            self._identified, self._usual_shape = self._template, shape
        elif not resting:
            sigma += _OUT_OF_STEP * self._speed(frame.stamp, shape)
        x, y, z = shape.centroid
        state = context.regions.state_of(x, y, z)
        # Beside the table a hand that comes in may hold it.
        whole = not partial and state != context.regions.elsewhere
        self._seen_whole |= whole and not s.beside_limb
        identity = s.identity if self._seen_whole else _SURE_BY_PART * s.identity
        probability = state_probability(context.regions, (x, y, z), sigma)
        if context.doubtful or (identity < _SURE_IDENTITY and not resting):
            probability = tuple(
                identity * p + (1 - identity) / len(probability) for p in probability
            )
        return ObjectObservation(
            name=self.known.name,
            state=state,
            state_probability=probability,
            visible=True,
            settled=resting and not partial,
            shape=shape,
            identity_probability=identity,
            last_seen=frame.stamp,
            pixels=s.blob.pixels,
        )

    def _speed(self, stamp: int, shape: Shape) -> float:
        """Mean speed over the table, m/s, since it was last seen; 0 if it never was."""
        if self._last.shape is None or stamp <= self._last.last_seen:
            return 0.0
        away = horizontal_distance(shape.centroid, self._last.centroid)
        return away / seconds(stamp - self._last.last_seen)

    def _partly_seen(
        self, frame: RgbdFrame, s: ObjectDetection, fraction: float, context: FrameContext
    ) -> tuple[Shape, float]:
        """Shape of a partly occluded object, and its centroid's standard deviation, m."""
        least, template = self._config.visible_fraction, self._template
        if template is not None and len(self.unchanged(frame)) >= least * len(template.pixels):
            # It has not moved, so the centroid before the occlusion is still right.
            return template.shape, self._config.centroid_sigma
        whole = correct_occluded_shape(
            s.shape, s.blob, self._usual_shape, context.limb_mask, context.view
        )
        return whole, self._config.centroid_sigma + (1 - fraction) * self.known.length / 6

    def _at_rest(self, stamp: int, shape: Shape) -> bool:
        """Whether the centroid has stayed within rest_radius for settle_time."""
        x, y, _ = shape.centroid
        anchor = self._anchor
        if anchor is None or np.hypot(x - anchor[0], y - anchor[1]) > self._config.rest_radius:
            self._anchor, self._rest_since, self._template = (x, y), stamp, None
            known = self._identified
            if known is not None and (
                horizontal_distance(shape.centroid, known.shape.centroid)
                > self._config.rest_radius
            ):
                self._identified = None
        return stamp - self._rest_since >= nanoseconds(self._config.settle_time)

    def _held_by_absorbed(self, s: ObjectDetection, context: FrameContext) -> bool:
        """Whether the object is higher than it can stand, beside an absorbed hand."""
        raised = s.shape.height > max(self.known.height, self.known.length) + _RAISED
        return raised and bool(cv2.dilate(context.absorbed_mask, _TOUCH).take(s.blob.pixels).any())

    def _unseen(self, stamp: int, context: FrameContext, maybe: bool) -> ObjectObservation:
        """The object while it is not detected.

        If it was elsewhere, it still is, unless a hand may bring it. Otherwise, if a hand or an
        arm is in view, an absorbed one covers its place, a part of the table was not seen or
        something may be it, it may be hidden or held: unknown. Otherwise it is elsewhere after
        absence_time.
        """
        last = self._last
        self._anchor = None
        if self._unseen_since is None:
            self._unseen_since = stamp
        elsewhere = context.regions.elsewhere
        if last.state == elsewhere and self._may_be_back(context, maybe):
            return _unknown(last, 'a hand may have brought it back', context.regions)
        hidden = '' if last.state == elsewhere else self._why_hidden(context, maybe)
        if hidden:
            self._unseen_since = stamp
            return _unknown(last, hidden, context.regions)
        gone = stamp - self._unseen_since >= nanoseconds(self._config.absence_time)
        if last.state == elsewhere or gone:
            if gone:
                self._template = self._identified = None
                self._seen_whole = False
            return _not_visible(
                last, elsewhere, gone and not context.limb_in_view, context.regions
            )
        seen = _not_visible(last, last.state, False, context.regions)
        return (
            seen if last.state is None else replace(seen, state_probability=last.state_probability)
        )

    def _may_be_back(self, context: FrameContext, maybe: bool) -> bool:
        """Whether a hand may have brought the object since the whole table was seen without it."""
        self._brought |= context.hand
        if self._brought and not context.limb_in_view:
            self._brought = maybe or not context.table_seen()
        return self._brought

    def _why_hidden(self, context: FrameContext, maybe: bool) -> str:
        """Why the object may be there although it is not seen; empty if it may not."""
        if context.limb_in_view:
            return f'{"a hand" if context.hand else "an arm"} may cover or hold it'
        if context.hidden_by_absorbed(self._last.centroid):
            return 'a hand or an arm that rests covers its place'
        if maybe:
            return 'something in view may be it'
        return '' if context.table_seen() else 'part of the table has no depth'


def _not_visible(
    last: ObjectObservation, state: State | None, settled: bool, regions: Regions
) -> ObjectObservation:
    return ObjectObservation(
        last.name,
        state,
        certain(state, regions),
        visible=False,
        settled=settled,
        shape=last.shape,
        last_seen=last.last_seen,
    )


def _unknown(last: ObjectObservation, reason: str, regions: Regions) -> ObjectObservation:
    return replace(_not_visible(last, None, False, regions), reason=reason)

"""One object over time: where it is, whether it rests, and what may be said when unseen."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from likeme_core.regions import Regions
from likeme_core.tabletop import State
from likeme_perception.config import PerceptionConfig
from likeme_perception.identification import CatalogueObject
from likeme_perception.observation import ObjectObservation
from likeme_perception.partial import with_hidden_part
from likeme_perception.regions import certain, state_probability
from likeme_perception.rgbd import RgbdFrame, depth_sigma
from likeme_perception.segmentation import Blob, Index, Shape
from likeme_perception.view import TableView

ImageF = NDArray[np.float32]

SECOND = 1_000_000_000


class Sighting(NamedTuple):
    """An object found in a frame: pixels, points and colours, shape, p(identity)."""

    blob: Blob
    shape: Shape
    identity: float
    beside_intruder: bool


class Scene(NamedTuple):
    """What else a frame shows.

    hand, arm: in view. hiding: their mask, (H, W). parked: mask of what once reached in and has
    not moved for so long that it is background, (H, W).
    """

    hand: bool
    arm: bool
    hiding: NDArray[np.uint8]
    parked: NDArray[np.uint8]
    view: TableView
    regions: Regions

    @property
    def intruder(self) -> bool:
        """Whether anything in view could hide or hold an object."""
        return self.hand or self.arm

    def may_hide(self, place: tuple[float, float, float]) -> bool:
        """Whether what is parked over the table covers a place, m."""
        if not np.isfinite(place).all():
            return False
        column, row = (int(v) for v in np.rint(self.view.project(np.array([place]))[0]))
        height, width = self.parked.shape
        return 0 <= row < height and 0 <= column < width and bool(self.parked[row, column])


class Template(NamedTuple):
    """A resting object as it was last seen in full: pixels, depths (m) and shape."""

    pixels: Index
    depth: ImageF
    shape: Shape
    identity: float


class ObjectTrack:
    """Follows one object of the catalogue from frame to frame."""

    def __init__(self, known: CatalogueObject, config: PerceptionConfig) -> None:
        self.known = known
        self._config = config
        self._usual_area = known.area
        self._usual_shape = Shape((0.0, 0.0, 0.0), 0.0, known.length, known.width, known.height)
        self._last = ObjectObservation(known.name)
        self._anchor: tuple[float, float] | None = None
        self._rest_since = 0
        self._unseen_since: int | None = None
        self.template: Template | None = None

    def unchanged(self, frame: RgbdFrame) -> Index:
        """Pixels in which the resting object still is where it was, by its depths."""
        if self.template is None:
            return np.zeros(0, np.intp)
        now = frame.depth.ravel()[self.template.pixels]
        near = np.abs(now - self.template.depth) < 0.005 + 3 * depth_sigma(self.template.depth)
        return np.asarray(self.template.pixels[near])

    def update(
        self, frame: RgbdFrame, sighting: Sighting | None, scene: Scene
    ) -> ObjectObservation:
        """The object in this frame."""
        fraction = 0.0 if sighting is None else min(1.0, sighting.blob.area / self._usual_area)
        if sighting is not None and fraction >= self._config.visible_fraction:
            self._last = self._seen(frame, sighting, fraction, scene)
        else:
            self._last = self._unseen(frame.stamp, scene)
        return self._last

    def _seen(
        self, frame: RgbdFrame, s: Sighting, fraction: float, scene: Scene
    ) -> ObjectObservation:
        self._unseen_since = None
        partial = scene.intruder and (fraction < 0.85 or s.beside_intruder)
        shape, sigma = s.shape, self._config.centroid_sigma
        if partial:
            shape, sigma = self._partly_seen(frame, s, fraction, scene)
        resting = self._at_rest(frame.stamp, shape)
        if not scene.intruder:
            self._usual_area += 0.05 * (s.blob.area - self._usual_area)
        if resting and not partial:
            depth = frame.depth.ravel()[s.blob.pixels]
            self.template = Template(s.blob.pixels, depth, shape, s.identity)
            self._usual_shape = shape
        x, y, z = shape.centroid
        return ObjectObservation(
            name=self.known.name,
            state=scene.regions.state_of(x, y, z),
            state_probability=state_probability(scene.regions, (x, y, z), sigma),
            visible=True,
            settled=resting and not partial,
            shape=shape,
            identity_probability=s.identity,
            last_seen=frame.stamp,
            pixels=s.blob.pixels,
        )

    def _partly_seen(
        self, frame: RgbdFrame, s: Sighting, fraction: float, scene: Scene
    ) -> tuple[Shape, float]:
        """Shape of an object beside or under a hand or an arm, and its centroid's deviation, m."""
        least, template = self._config.visible_fraction, self.template
        if template is not None and len(self.unchanged(frame)) >= least * len(template.pixels):
            # It has not moved: what hides a part of it does not move its middle.
            return template.shape, self._config.centroid_sigma
        whole = with_hidden_part(s.shape, s.blob, self._usual_shape, scene.hiding, scene.view)
        return whole, self._config.centroid_sigma + (1 - fraction) * self.known.length / 6

    def _at_rest(self, stamp: int, shape: Shape) -> bool:
        """Whether the centroid has stayed within rest_radius for settle_time."""
        x, y, _ = shape.centroid
        anchor = self._anchor
        if anchor is None or np.hypot(x - anchor[0], y - anchor[1]) > self._config.rest_radius:
            self._anchor, self._rest_since, self.template = (x, y), stamp, None
        return stamp - self._rest_since >= self._config.settle_time * SECOND

    def _unseen(self, stamp: int, scene: Scene) -> ObjectObservation:
        """What may be said of an object that is not seen.

        Seen last OFFTABLE: it still is. Else a hand or an arm in view may hide or hold it, or one
        that is parked over its place: unknown. Without them it is OFFTABLE, once it has not been
        seen for absence_time.
        """
        last = self._last
        self._anchor = None
        if self._unseen_since is None:
            self._unseen_since = stamp
        hidden = scene.intruder or scene.may_hide(last.centroid)
        if hidden and last.state is not State.OFFTABLE:
            self._unseen_since = stamp
            return self._blind(last, None, False)
        gone = stamp - self._unseen_since >= self._config.absence_time * SECOND
        if last.state is State.OFFTABLE or gone:
            self.template = None if gone else self.template
            return self._blind(last, State.OFFTABLE, gone and not scene.intruder)
        return self._blind(last, last.state, False)

    def _blind(
        self, last: ObjectObservation, state: State | None, settled: bool
    ) -> ObjectObservation:
        return ObjectObservation(
            last.name,
            state,
            certain(state),
            False,
            settled,
            last.shape,
            0.0,
            last.last_seen,
        )

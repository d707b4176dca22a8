"""What a camera sees of a recording: who stands where, in which order, from which pose."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from eyes_parts.recording import RATE, Moment, Recording
from likeme_arm_sim.background import cell_background
from likeme_arm_sim.hand_shapes import Posture, hand_parts
from likeme_arm_sim.kinect import Kinect, RgbdImages
from likeme_arm_sim.meshes import box
from likeme_arm_sim.renderer import MeshRenderer, RenderBody
from likeme_arm_sim.toys import toys_of
from likeme_core.camera_mount import CameraMount
from likeme_core.paper_world import WORLD
from likeme_core.world import load_world

#: Moment at which the camera is bumped and the box put down: the background is long known.
EVENT = 4 * RATE
#: For so many moments at the start a hand covers objects, and so many s a held object is still.
COVERED, HELD = 5 * RATE // 2, 22.0
#: One frame in so many is torn; by so many frames the colours are late.
TORN, LATE = 5, 2
BOX = box((0.30, 0.10, 0.10), (150, 110, 70), (0.44, -0.32, 0.05))
#: Where the second lemon lies, m.
SPOT, LEMON = (0.44, -0.32), toys_of(WORLD)['lemon']
BANANA = toys_of(load_world('three_bins'))['banana']


@dataclass(frozen=True)
class TurnedMount(CameraMount):
    """A mount that was turned about axes of its optical frame; turn: rotation vector, rad."""

    turn: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def pose(self) -> NDArray[np.float64]:
        """The turned optical frame in base_link, 4x4."""
        pose = super().pose()
        pose[:3, :3] = pose[:3, :3] @ Rotation.from_rotvec(self.turn).as_matrix()
        return pose


@dataclass(frozen=True)
class Seen:
    """One frame of a scene; k: its number at 30 Hz."""

    k: int
    moment: int
    images: RgbdImages


@dataclass(frozen=True)
class Scene:
    """The recorded cell; subclasses change one thing."""

    #: Objects that are not what they are in the recording.
    hidden: tuple[str, ...] = ()
    #: Frame from which errors count: 0, or 2 s after the camera was bumped.
    judged_from: int = 0

    def order(self, recording: Recording) -> list[int]:
        """The moments in the order they are seen."""
        return list(range(len(recording.moments)))

    def bodies(self, moment: Moment, k: int) -> list[RenderBody]:
        """What is drawn in frame k."""
        return moment.bodies()

    def mount(self, k: int, seed: int) -> CameraMount:
        """The camera in frame k."""
        return WORLD.camera

    def frames(self, recording: Recording, every: int) -> Iterator[Seen]:
        """Every so manieth frame of the scene."""
        mount, renderer, kinect = None, None, None
        for k, moment in list(enumerate(self.order(recording)))[::every]:
            now = self.mount(k, recording.seed)
            if renderer is None or kinect is None or now != mount:
                mount, renderer = now, MeshRenderer(now, cell_background(WORLD.table))
                kinect = kinect or Kinect(now, seed=recording.seed)
            drawn = renderer.render(self.bodies(recording.moments[moment], k))
            yield Seen(k, moment, kinect.sense(drawn))


@dataclass(frozen=True)
class Bumped(Scene):
    """The camera is turned by some degrees at once, about an axis that the seed chooses."""

    degrees: float = 1.0
    judged_from: int = EVENT + 2 * RATE

    def mount(self, k: int, seed: int) -> CameraMount:
        """The turned camera from EVENT on."""
        if k < EVENT:
            return WORLD.camera
        axis = np.random.default_rng([seed, 2]).normal(size=3)
        x, y, z = np.radians(self.degrees) * axis / np.linalg.norm(axis)
        known = {name: getattr(WORLD.camera, name) for name in CameraMount.__dataclass_fields__}
        return TurnedMount(**known, turn=(float(x), float(y), float(z)))


@dataclass(frozen=True)
class SmallImage(Scene):
    """A camera of 320x240 with the noise of each pixel as it is at 640x480."""

    def mount(self, k: int, seed: int) -> CameraMount:
        """Half the pixels along each side."""
        full = WORLD.camera
        return replace(
            full, width=320, height=240, fx=full.fx / 2, fy=full.fy / 2,
            cx=(full.cx - 0.5) / 2, cy=(full.cy - 0.5) / 2,
        )  # fmt: skip


@dataclass(frozen=True)
class BoxPutDown(Scene):
    """A box of 30 cm stands on the table from EVENT on."""

    def bodies(self, moment: Moment, k: int) -> list[RenderBody]:
        """The bodies and the box."""
        return moment.bodies() + ([RenderBody(BOX, np.eye(4))] if k >= EVENT else [])


@dataclass(frozen=True)
class SecondLemon(Scene):
    """Another lemon lies on the table from a frame on."""

    since: int = 0

    def bodies(self, moment: Moment, k: int) -> list[RenderBody]:
        """The bodies and that lemon."""
        if k < self.since:
            return moment.bodies()
        where = np.eye(4)
        where[:3, 3] = (*SPOT, LEMON.resting_height)
        return moment.bodies() + [RenderBody(part, where) for part in LEMON.parts]


@dataclass(frozen=True)
class HandAtStart(Scene):
    """A resting hand covers the first object while the background is learned."""

    def bodies(self, moment: Moment, k: int) -> list[RenderBody]:
        """The bodies and that hand."""
        if k >= COVERED:
            return moment.bodies()
        where = np.eye(4)
        where[:3, 3] = moment.toys[WORLD.objects[0]][:3, 3] + (0.03, 0.0, 0.06)
        hand = hand_parts(Posture.GRASP).values()
        return moment.bodies() + [RenderBody(part, where) for part in hand]


@dataclass(frozen=True)
class Torn(Scene):
    """In every TORN-th frame the lower half is that of the frame before, from EVENT on."""

    def frames(self, recording: Recording, every: int) -> Iterator[Seen]:
        """The frames, some of them torn."""
        before: Seen | None = None
        for n, seen in enumerate(super().frames(recording, every)):
            if before is None or seen.k < EVENT or n % TORN:
                yield seen
            else:
                old = before.images
                half = len(old.rgb) // 2
                yield replace(seen, images=RgbdImages(
                    np.concatenate([seen.images.rgb[:half], old.rgb[half:]]),
                    np.concatenate([seen.images.depth_mm[:half], old.depth_mm[half:]]),
                ))  # fmt: skip
            before = seen


@dataclass(frozen=True)
class ColoursLate(Scene):
    """The colours are those of LATE frames before the depth."""

    def frames(self, recording: Recording, every: int) -> Iterator[Seen]:
        """The frames, their images out of step."""
        last: deque[NDArray[np.uint8]] = deque(maxlen=LATE + 1)
        for seen in super().frames(recording, every):
            last.append(seen.images.rgb)
            yield replace(seen, images=seen.images._replace(rgb=last[0]))


@dataclass(frozen=True)
class BananaForLemon(Scene):
    """A banana takes the lemon's place; the lemon is not there."""

    hidden: tuple[str, ...] = ('lemon',)

    def bodies(self, moment: Moment, k: int) -> list[RenderBody]:
        """The bodies with a banana."""
        return moment.bodies({'lemon': BANANA})


@dataclass(frozen=True)
class HeldStill(Scene):
    """In the first act by placing, the person stops for 22 s with the object in the hand."""

    def order(self, recording: Recording) -> list[int]:
        """The moments, one of them for 22 s."""
        m = self._held(recording)
        order = list(range(len(recording.moments)))
        return order[:m] + [m] * round(HELD * RATE) + order[m:]

    def _held(self, recording: Recording) -> int:
        """A moment in which an object is 6 cm above where it lay and in another region."""
        for act in recording.acts:
            name, x_i = act.change[:2]
            lay = recording.moments[act.first].toys[name][2, 3]
            for m in range(act.first, act.last):
                now = recording.moments[m]
                if now.toys[name][2, 3] > lay + 0.06 and now.truth[name].state != x_i:
                    return m
        raise ValueError('Expected an act by placing, got none.')

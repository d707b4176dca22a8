"""The cores in this process, as the nodes run them: perception and imitation without a network."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import cv2

from likeme_bags.values import Record
from likeme_core.observations import Demonstration, TableSnapshot
from likeme_core.settings import defaults
from likeme_inference import node_settings as inference_settings
from likeme_inference.input_sequencer import Cue, Input
from likeme_inference.tabletop.session import ImitationSession
from likeme_inference.tabletop.values import Decision, GoalBelief, Outcome, Remark
from likeme_perception import node_settings as perception_settings
from likeme_perception.observation import TableObservation
from likeme_perception.pairing import StampOrder
from likeme_perception.pipeline import TabletopPerception
from likeme_perception.rgbd import Intrinsics, RgbdFrame, decode_depth, decode_rgb
from likeme_replay import log_entries as entries
from likeme_replay.decision_log import Entry
from likeme_replay.input_scheduler import Done
from likeme_replay.message_definitions import definitions
from likeme_replay.recorded_inputs import Frame

Told = GoalBelief | Decision | Outcome | Remark | None


class Eyes:
    """What the perception node does with frames, one after another."""

    def __init__(self, values: Mapping[str, Any]) -> None:
        """`values`: parameters of the perception node that differ from their defaults.

        Raises:
            ValueError, OSError: one makes no sense.
        """
        given = defaults(perception_settings.SETTINGS) | dict(values)
        self._settings = perception_settings.read_settings(given)
        self._order = StampOrder()
        self._info = b''
        self._intrinsics: Intrinsics | None = None
        self._perception: TabletopPerception | None = None
        # As in the node: threads for images this small only wait for each other.
        cv2.setNumThreads(1)

    def read(self, frame: Frame) -> TableObservation:
        """Read a frame.

        Raises:
            ValueError: it cannot be read, or is older than the one before it.
        """
        self._look_through(frame.info)
        order = self._order.take(frame.stamp)
        if order == 'older':
            raise ValueError('a frame is older than the one before it')
        if order == 'restart' and self._perception is not None:
            self._perception.reset_tracking()
        if self._intrinsics is None:
            raise ValueError('no camera_info has come yet')
        seen = rgbd_frame(frame)
        if not seen.has_depth:
            raise ValueError(f'Expected depth readings, got 0 of {seen.depth.size}.')
        if self._perception is None:
            config, catalogue, _ = self._settings
            self._perception = TabletopPerception(config, self._intrinsics, catalogue)
        return self._perception.process(seen)

    def _look_through(self, info: Record) -> None:
        """Take a camera_info; what cannot be one leaves the last in force."""
        # The stamp is not what makes another camera.
        if info.data[12:] == self._info:
            return
        self._info = info.data[12:]
        try:
            intrinsics = intrinsics_of(definitions().read(info.data, info.type))
        except ValueError:
            return
        if intrinsics != self._intrinsics:
            self._intrinsics, self._perception = intrinsics, None


class Mind:
    """What the inference node does in a rehearsal."""

    def __init__(self, values: Mapping[str, Any]) -> None:
        """`values`: parameters of the inference node that differ from their defaults.

        Raises:
            ValueError: one makes no sense.
        """
        given = defaults(inference_settings.SETTINGS) | dict(values)
        model = inference_settings.read_model(given['model_file'])
        self.session = ImitationSession(model, inference_settings.read_settings(given))

    def see(self, view: TableSnapshot) -> list[Told]:
        """Take in a table state."""
        return [self.session.look(view)]

    def watch(self, demo: Demonstration) -> list[Told]:
        """Take in a demonstration; one of what the robot never tried is nothing to it."""
        if demo.object not in self.session.model.objects:
            return []
        return [self.session.observe_demonstration(demo), self.session.look_again()]

    def hear(self, cue: Cue) -> list[Told]:
        """Take in what arm or operator said, or that nobody did.

        Raises:
            ValueError: it does not fit where the session stands.
        """
        if cue.kind is Input.MOTION:
            return [self.session.motion_finished(entries.motion_report(cue.said))]
        if cue.kind is Input.SILENCE:
            return [self.session.nothing_seen()]
        return [self.session.answered(entries.reply(cue.said))]


class Cores:
    """A stage without a network: shows frames to the eyes, gives cues to the mind.

    Attributes:
        misfits: what arm or operator said in the recorded run that made no sense here.
    """

    def __init__(
        self,
        perception: Mapping[str, Any] | None = None,
        inference: Mapping[str, Any] | None = None,
    ) -> None:
        self.eyes, self.mind = Eyes(perception or {}), Mind(inference or {})
        self._views: dict[int, TableSnapshot] = {}
        self._acts: dict[int, list[Demonstration]] = {}
        self.table: TableObservation | None = None
        self.misfits = 0

    def show(self, frame: Frame) -> Done:
        """Read a frame."""
        try:
            table = self.eyes.read(frame)
        except (ValueError, cv2.error) as error:
            return Done(False, refused=str(error))
        self.table = table
        if table.learned:
            self._views[frame.stamp] = table.snapshot
            self._acts[frame.stamp] = list(table.demonstrations)
        told = tuple(entries.act_entry(act) for act in table.demonstrations)
        return Done(table.learned, told)

    def hear(self, cue: Cue) -> list[Entry]:
        """Take something in."""
        try:
            told = self._hear(cue)
        except ValueError:
            self.misfits += 1
            return []
        return [entries.entry(one) for one in told if not isinstance(one, Remark | None)]

    def _hear(self, cue: Cue) -> list[Told]:
        if cue.kind is Input.TABLE_STATE:
            view = self._views[cue.stamp]
            self._views = {stamp: v for stamp, v in self._views.items() if stamp > cue.stamp}
            return self.mind.see(view)
        if cue.kind is Input.DEMONSTRATION:
            acts = self._acts[cue.stamp]
            act = acts.pop(0)
            self._acts = {stamp: a for stamp, a in self._acts.items() if a}
            return self.mind.watch(act)
        return self.mind.hear(cue)


def rgbd_frame(frame: Frame) -> RgbdFrame:
    """The images of a frame as perception's value.

    Raises:
        ValueError: an encoding is not known, or sizes do not fit.
    """
    colour = definitions().read(frame.colour.data, frame.colour.type)
    depth = definitions().read(frame.depth.data, frame.depth.type)
    return RgbdFrame(
        frame.stamp,
        depth.header.frame_id,
        decode_rgb(colour.data, colour.encoding, colour.height, colour.width, colour.step),
        decode_depth(
            depth.data, depth.encoding, depth.height, depth.width, depth.step,
            bool(depth.is_bigendian),
        ),
    )  # fmt: skip


def intrinsics_of(info: Any) -> Intrinsics:
    """Intrinsics of a rectified camera, from P, or from K where P is not filled in."""
    p, k = info.p, info.k
    lens = (p[0], p[2], p[5], p[6]) if p[0] > 0 else (k[0], k[2], k[4], k[5])
    fx, cx, fy, cy = map(float, lens)
    return Intrinsics(fx, fy, cx, cy, int(info.width), int(info.height))

"""Perception and inference in this process, without a network."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import cv2

from likeme_core.observations import Demonstration, TableSnapshot
from likeme_core.settings import defaults
from likeme_core.world import load_world
from likeme_inference import node_settings as inference_settings
from likeme_inference.session_inputs import (
    InputKind,
    InputValue,
    SessionInput,
    apply_input,
    read_heard,
)
from likeme_inference.tabletop.session import ImitationSession
from likeme_inference.tabletop.values import Remark
from likeme_perception import node_settings as perception_settings
from likeme_perception.frame_reader import FrameReader
from likeme_perception.observation import TableObservation
from likeme_replay.decision_log import LogEntry, entry_of_event
from likeme_replay.input_scheduler import FrameAck
from likeme_replay.message_definitions import definitions
from likeme_replay.recorded_inputs import RecordedFrame
from likeme_replay.recorded_parameters import world_of


class InProcessGraph:
    """A ReplayTarget that calls the cores of both nodes directly.

    Attributes:
        session: the imitation session.
        table: perception's result for the newest frame that was read.
        refused_inputs: recorded reports of arm or operator that the session refused.
    """

    def __init__(
        self,
        perception: Mapping[str, Any] | None = None,
        inference: Mapping[str, Any] | None = None,
    ) -> None:
        """Take the nodes' parameters where they differ from their defaults.

        Raises:
            ValueError, OSError: one is invalid.
        """
        world = self._world = load_world(world_of(perception or {}, inference or {}))
        values = defaults(perception_settings.settings_of(world)) | dict(perception or {})
        self._reader = FrameReader(perception_settings.read_settings(values, world))
        values = defaults(inference_settings.settings_of(world)) | dict(inference or {})
        model = inference_settings.read_model(values['model_file'], world)
        settings = inference_settings.read_settings(values, world)
        self.session = ImitationSession(model, settings)
        self.table: TableObservation | None = None
        self.refused_inputs = 0
        self._tables: dict[int, TableSnapshot] = {}
        self._acts: dict[int, list[Demonstration]] = {}
        self._info = b''
        # As in perception_node: OpenCV's threads do not pay for images this small.
        cv2.setNumThreads(1)

    def show_frame(self, frame: RecordedFrame) -> FrameAck:
        """Run perception on a frame."""
        self._set_camera_info(frame.info.data)
        colour, depth = (definitions().read(r.data, r.type) for r in (frame.colour, frame.depth))
        result = self._reader.read(colour, depth)
        if result.table is None:
            return FrameAck(table_state=False, rejection=result.sentence)
        self.table = table = result.table
        if table.learned:
            self._tables[frame.stamp] = table.snapshot
            self._acts[frame.stamp] = list(table.demonstrations)
        return FrameAck(table.learned, tuple(map(entry_of_event, table.demonstrations)))

    def apply_input(self, item: SessionInput) -> list[LogEntry]:
        """Apply an input to the session."""
        try:
            events = apply_input(self.session, self._value(item))
        except ValueError:
            self.refused_inputs += not item.kind.has_topic
            return []
        return [entry_of_event(event) for event in events if not isinstance(event, Remark)]

    def _value(self, item: SessionInput) -> InputValue:
        if item.kind is InputKind.TABLE_STATE:
            table = self._tables[item.stamp]
            self._tables = {s: t for s, t in self._tables.items() if s > item.stamp}
            return table
        if item.kind is InputKind.DEMONSTRATION:
            act = self._acts[item.stamp].pop(0)
            self._acts = {stamp: acts for stamp, acts in self._acts.items() if acts}
            return act
        return read_heard(item.kind, item.message, self._world)

    def _set_camera_info(self, data: bytes) -> None:
        # Without the stamp, which differs in every frame.
        if data[12:] == self._info:
            return
        self._info = data[12:]
        try:
            self._reader.set_camera_info(definitions().read(data, 'sensor_msgs/msg/CameraInfo'))
        except ValueError:
            # The last usable one stays in force; without one the frames are rejected.
            return

"""The frames of a recording, decoded, with the intrinsics of their camera."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import cv2

from likeme_bags.reading import Bag
from likeme_core.settings import defaults
from likeme_core.world import World, load_world
from likeme_perception import node_settings
from likeme_perception.frame_reader import decode_frame, intrinsics_of
from likeme_perception.node_settings import NodeSettings
from likeme_perception.rgbd import Intrinsics, RgbdFrame
from likeme_replay import recorded_parameters
from likeme_replay.message_definitions import definitions
from likeme_replay.recorded_inputs import RecordedFrame, RecordedInputs
from likeme_replay.source_adapters import adapted_source


class CameraFrame(NamedTuple):
    """A frame, and the camera that took it."""

    frame: RgbdFrame
    intrinsics: Intrinsics


def recorded_frames(bag: Bag) -> Iterator[CameraFrame]:
    """The frames of a bag that can be decoded; topics of known drivers are found by their names.

    Raises:
        BagError: colour, depth or camera_info are not there.
    """
    for step in RecordedInputs(adapted_source({}, {})(bag, None, None)).steps():
        if isinstance(step, RecordedFrame):
            try:
                info, colour, depth = (
                    definitions().read(record.data, record.type)
                    for record in (step.info, step.colour, step.depth)
                )
                yield CameraFrame(decode_frame(colour, depth), intrinsics_of(info))
            except (ValueError, cv2.error):
                continue


def recorded_settings(bag: Bag, world: str | None) -> tuple[NodeSettings, World]:
    """The settings of perception that a bag was recorded with, and their world.

    world: another one by its name or file; None: the recorded one, or the default.

    Raises:
        ValueError: the recorded parameters are not valid, or there is no such world.
    """
    parameters = recorded_parameters.recorded(bag.custom)
    if world is not None:
        parameters = recorded_parameters.in_world(parameters, world)
    values = parameters.get('perception_node', {})
    used = load_world(recorded_parameters.world_of(*parameters.values()))
    known = node_settings.settings_of(used)
    given = {name: value for name, value in values.items() if name in known}
    return node_settings.read_settings(defaults(known) | given, used), used

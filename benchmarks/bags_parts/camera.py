"""A camera's 30 Hz with fresh noise in every frame, as messages."""

from __future__ import annotations

import camera_messages
from likeme_arm_sim.cell import Cell
from likeme_bags.values import Record
from likeme_core.paper_world import WORLD

HZ = 30.0
#: Frames that differ; more would only take longer to draw.
FRAMES = 30


def noisy_frames() -> list[tuple[Record, ...]]:
    """camera_info, colour and depth of the cell, with fresh noise in each, as a Kinect's."""
    cell = Cell(WORLD, 1)
    made: list[tuple[Record, ...]] = []
    for _ in range(FRAMES):
        cell.step(1 / HZ)
        images, camera = cell.frame(), WORLD.camera
        made.append(camera_messages.frame_records(0, images.rgb, images.depth_mm, camera))
    return made


def numbered(record: Record, number: int) -> Record:
    """A frame's record with its number in place of the header stamp's seconds."""
    data = record.data[:4] + number.to_bytes(4, 'little') + record.data[8:]
    return record._replace(stamp=round(number / HZ * 1e9), data=data)

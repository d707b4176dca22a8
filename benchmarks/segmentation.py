"""Processor time of a frame: perception, and Open3D's plane and clustering on the same frames.

    ./scripts/bench.sh segmentation [--json]

A person and the robot act in the simulated cell, seen by the Kinect model at 30 Hz, 640x480.
Perception takes in every frame; Open3D every tenth, right after it. Processor time of the whole
process counts, so that Open3D's threads do. Perception does more: it also tells the objects, hand
and arm apart, tracks, and gives states and demonstrations.
"""

from __future__ import annotations

import sys
import time

import cv2
import numpy as np

import report
from likeme_arm.motion import ObjectView
from likeme_arm_sim.cell import Cell
from likeme_core.outcomes import Actor
from likeme_core.paper_world import PLACE_LEFT, PUSH_RIGHT, WORLD
from likeme_experiments.learning.cell_perception import object_view
from likeme_perception.catalogue import world_catalogue
from likeme_perception.config import world_config
from likeme_perception.observation import TableObservation
from likeme_perception.pipeline import TabletopPerception
from likeme_perception.rgbd import Intrinsics, RgbdFrame, depth_in_metres
from segmentation_peers import Clustering

#: Perception must be so many times as fast.
RATIO = 10.0
EVERY, RATE, SEED = 10, 30.0, 0
ACTS = ((Actor.HUMAN, 'chicken', PLACE_LEFT), (Actor.ROBOT, 'lemon', PUSH_RIGHT))


class Watched:
    """A cell, and what both need for its frames.

    Attributes:
        times: ms of processor time by what is in view: of perception and of Open3D, for the same
            frames.
    """

    def __init__(self) -> None:
        self.cell = Cell(WORLD, SEED)
        camera = self.cell.world.camera
        lens = Intrinsics(camera.fx, camera.fy, camera.cx, camera.cy, camera.width, camera.height)
        self.perception = TabletopPerception(world_config(WORLD), lens, world_catalogue(WORLD))
        self.peer = Clustering(lens)
        self.times: dict[str, list[tuple[float, float]]] = {}
        self._table: TableObservation | None = None
        self._frames, self._due = 0, 0.0

    def look(self, name: str) -> ObjectView | None:
        """An object as the arm receives it."""
        return None if self._table is None else object_view(self._table.object(name))

    def tick(self) -> None:
        """Take in a frame when it is due."""
        if self.cell.time < self._due:
            return
        self._due += 1 / RATE
        images = self.cell.frame()
        depth = depth_in_metres(images.depth_mm)
        frame = RgbdFrame(round(self.cell.time * 1e9), 'camera', images.rgb, depth)
        begin = time.process_time()
        self._table = table = self.perception.process(frame)
        ours = time.process_time() - begin
        self._frames += 1
        if not table.learned or self._frames % EVERY:
            return
        begin = time.process_time()
        self.peer.look(depth)
        theirs = time.process_time() - begin
        what = 'arm' if table.arm_in_view else 'hand' if table.hand_in_view else 'nothing else'
        self.times.setdefault(what, []).append((ours * 1e3, theirs * 1e3))


def main() -> None:
    """Measure and publish; exit code 1 when a bar is missed."""
    report.option_parser('segmentation').parse_args()
    cv2.setNumThreads(1)
    watched = Watched()
    watched.cell.step(3.0, watched.tick)
    for act in ACTS:
        watched.cell.run_action(*act, watched.look, watched.tick)
        watched.cell.step(2.0, watched.tick)
    bars = []
    for what, pairs in watched.times.items():
        ours, theirs = np.median(pairs, axis=0)
        bars += [
            report.Bar(f'{what} in view: perception', ours, None, 'ms', None, len(pairs)),
            report.Bar(f'{what} in view: Open3D', theirs, None, 'ms', None, len(pairs)),
            report.Bar(f'{what} in view: times as fast', theirs / ours, RATIO, '',
                       'Open3D, 5 mm voxels', len(pairs), False),
        ]  # fmt: skip
    notes = {'clusters that Open3D finds in the last frame': watched.peer.clusters}
    sys.exit(0 if report.publish('segmentation', bars, notes) else 1)


if __name__ == '__main__':
    main()

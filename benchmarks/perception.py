"""Perception: time per frame, and accuracy against ground truth and labelled frames.

Human and robot actions in the simulated cell, for several seeds; times are processor time of one
thread. If the real RGB-D frames are available (`LIKEME_SHARED`, or `../shared` beside the project)
the same pipeline is evaluated on them too.
"""

from __future__ import annotations

import math
import os
import sys
import time
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
from rich.console import Console

import report
from likeme_arm.motion import ObjectView
from likeme_arm_sim.cell import Cell
from likeme_core.observations import Demonstration
from likeme_core.outcomes import Actor
from likeme_core.paper_world import (
    OFFTABLE,
    PLACE_LEFT,
    PLACE_OFFTABLE,
    PLACE_RIGHT,
    PUSH_LEFT,
    PUSH_OFFTABLE,
    PUSH_RIGHT,
    WORLD,
)
from likeme_core.progress_bar import ProgressBar, counted
from likeme_core.tabletop import Action, Manner
from likeme_experiments.learning.cell_perception import object_view
from likeme_perception.blobs import mask_of
from likeme_perception.catalogue import world_catalogue
from likeme_perception.config import world_config
from likeme_perception.image_pairs import read_frame, read_intrinsics
from likeme_perception.observation import TableObservation
from likeme_perception.pipeline import TabletopPerception
from likeme_perception.rgbd import Intrinsics, RgbdFrame, depth_in_metres
from likeme_perception.single_frame import look_at

FRAME_RATE = 30.0
SEEDS = 3
ACTS: tuple[tuple[Actor, str, Action], ...] = (
    (Actor.HUMAN, 'chicken', PLACE_LEFT),
    (Actor.HUMAN, 'chicken', PLACE_RIGHT),
    (Actor.ROBOT, 'chicken', PUSH_LEFT),
    (Actor.HUMAN, 'pear', PUSH_LEFT),
    (Actor.ROBOT, 'lemon', PLACE_RIGHT),
    (Actor.HUMAN, 'lemon', PLACE_OFFTABLE),
    (Actor.ROBOT, 'pear', PUSH_RIGHT),
    (Actor.HUMAN, 'chicken', PUSH_OFFTABLE),
)
SHARED = Path(os.environ.get('LIKEME_SHARED', Path(__file__).resolve().parents[2] / 'shared'))


class Measurements:
    """Measurements over all seeds."""

    def __init__(self) -> None:
        self.times: dict[str, list[float]] = {'empty': [], 'hand': [], 'arm': []}
        self.errors: list[float] = []
        self.states: list[bool] = []
        self.acts: list[bool] = []
        self.false_acts = 0
        self.unsettled = 0


class ObservedCell:
    """A cell and its perception."""

    def __init__(self, seed: int, tally: Measurements) -> None:
        self.cell = Cell(WORLD, seed)
        camera = self.cell.world.camera
        lens = camera.fx, camera.fy, camera.cx, camera.cy, camera.width, camera.height
        known = world_catalogue(WORLD)
        self.perception = TabletopPerception(world_config(WORLD), Intrinsics(*lens), known)
        self.table: TableObservation | None = None
        self.found: list[Demonstration] = []
        self._tally, self._due = tally, 0.0

    def tick(self) -> None:
        """Process a frame when it is due."""
        if self.cell.time < self._due:
            return
        self._due = self.cell.time + 1 / FRAME_RATE
        images = self.cell.frame()
        depth = depth_in_metres(images.depth_mm)
        frame = RgbdFrame(round(self.cell.time * 1e9), 'camera', images.rgb, depth)
        begin = time.thread_time()
        self.table = table = self.perception.process(frame)
        spent = time.thread_time() - begin
        self.found += table.demonstrations
        if table.learned and self.perception.background is not None:
            what = 'arm' if table.arm_in_view else 'hand' if table.hand_in_view else 'empty'
            self._tally.times[what].append(spent * 1e3)

    def look(self, name: str) -> ObjectView | None:
        """An object as the arm receives it."""
        return None if self.table is None else object_view(self.table.object(name))

    def do(self, actor: Actor, name: str, action: Action) -> None:
        """Act, wait until all objects rest, and compare with the ground truth."""
        before = self.cell.true_states()[name].state
        self.found.clear()
        self.cell.run_action(actor, name, action, self.look, self.tick)
        self.cell.step(2.0, self.tick)
        self._compare()
        after = self.cell.true_states()[name].state
        expected = []
        if actor is Actor.HUMAN and before != after:
            manner = Manner.PUSH if action.manner is Manner.PUSH else Manner.PLACE
            expected = [(name, before, after, manner)]
        said = [(a.object, int(a.x_i), int(a.x_f), a.manner) for a in self.found]
        self._tally.acts += [one in said for one in expected]
        self._tally.false_acts += len([one for one in said if one not in expected])

    def _compare(self) -> None:
        assert self.table is not None
        self._tally.unsettled += not self.table.settled
        truth = self.cell.true_states()
        for seen in self.table.objects:
            there = truth[seen.name]
            self._tally.states.append(seen.state == there.state)
            if seen.visible and there.state != OFFTABLE:
                off = np.hypot(seen.centroid[0] - there.x, seen.centroid[1] - there.y)
                self._tally.errors.append(float(off) * 1e3)


def cell_bars() -> list[report.Bar]:
    """Figures in the simulated cell."""
    tally = Measurements()
    bar = ProgressBar(Console(stderr=True), 'acts', SEEDS * len(ACTS), 0, math.inf)
    with bar.shown():
        for seed in range(SEEDS):
            watched = ObservedCell(seed, tally)
            watched.cell.step(2.0, watched.tick)
            for act in ACTS:
                watched.do(*act)
                bar.advance('')
    all_times = [t for times in tally.times.values() for t in times]
    bars = [
        report.Bar(
            f'time per frame, {what}, p50',
            float(np.median(times)),
            12.0,
            'ms',
            'own target; half a core at 30 Hz is 16.7 ms',
            len(times),
        )
        for what, times in tally.times.items()
    ]
    p99 = float(np.percentile(all_times, 99))
    return [
        *bars,
        report.Bar('time per frame, p99', p99, 33.0, 'ms', 'one frame at 30 Hz', len(all_times)),
        _all_of('states at rest right', tally.states),
        _all_of('acts found, manner right', tally.acts),
        report.Bar('false demonstrations', tally.false_acts, 0, '', 'truth', SEEDS * len(ACTS)),
        report.Bar('not settled after 2 s', tally.unsettled, 0, '', 'truth', SEEDS * len(ACTS)),
        _percentile('centroid error p50', tally.errors, 50, 5.0),
        _percentile('centroid error p95', tally.errors, 95, 10.0),
    ]  # fmt: skip


def _all_of(name: str, values: list[bool]) -> report.Bar:
    share = float(np.mean(values)) if values else float('nan')
    return report.Bar(name, share, 1.0, '', 'truth', len(values), False)


def _percentile(name: str, errors: list[float], q: float, bar: float) -> report.Bar:
    return report.Bar(name, float(np.percentile(errors, q)), bar, 'mm', 'truth', len(errors))


class Segmented(NamedTuple):
    """One labelled frame: IoU of the object mask, and how many objects were segmented whole.

    touching: objects within 3 pixels of another one.
    """

    iou: float
    objects: int
    whole: int
    touching: int
    touching_whole: int


def segmented(color: Path) -> Segmented:
    """Segment one MOSD frame; its labels count in tens, the units are parts of one object."""
    frame = read_frame(color, Path(str(color).replace('color', 'depth')))
    label = cv2.imread(str(color).replace('color', 'label'), cv2.IMREAD_UNCHANGED)
    assert label is not None
    _, perception = look_at(frame, read_intrinsics(color.parent / 'intrinsics.json', label.shape))
    background = perception.background
    assert background is not None
    found = background.foreground(frame) > 0
    table, _ = look_at(frame, perception.intrinsics)
    blobs = [mask_of(each.pixels, frame.depth.shape) > 0 for each in table.unknown_objects]
    objects = [label // 10 == k for k in np.unique(label // 10) if k > 1]
    whole = [any(_iou(blob, one) > 0.8 for blob in blobs) for one in objects]
    touching = [_touches_another(one, label // 10 > 1) for one in objects]
    both = sum(w and t for w, t in zip(whole, touching, strict=True))
    return Segmented(_iou(found, label > 1), len(objects), sum(whole), sum(touching), both)


def _touches_another(one: np.ndarray, any_object: np.ndarray) -> bool:
    near = cv2.dilate(one.astype(np.uint8), np.ones((7, 7), np.uint8)) > 0
    return bool((near & any_object & ~one).any())


def _iou(a: np.ndarray, b: np.ndarray) -> float:
    return float((a & b).sum() / max((a | b).sum(), 1))


def real_bars() -> list[report.Bar]:
    """Figures on real frames; none if they are not available."""
    frames = SHARED / 'data' / 'rgbd'
    if not frames.is_dir():
        return []
    paths = sorted((frames / 'mosd').glob('*_color.png'))
    desk = [segmented(path) for path in counted(paths, 'real frames', len(paths))]
    total = sum(d.objects for d in desk)
    return [
        report.Bar(
            'real desk: median IoU of the object mask',
            float(np.median([d.iou for d in desk])),
            0.98,
            '',
            'plane and 10 mm rule: .977',
            len(desk),
            False,
        ),
        report.Bar(
            'real desk: objects segmented whole',
            sum(d.whole for d in desk) / total,
            0.75,
            '',
            'plane and voxel convexity: .71 to .80',
            total,
            False,
        ),
        report.Bar(
            'real desk: touching objects segmented whole',
            sum(d.touching_whole for d in desk) / sum(d.touching for d in desk),
            0.7,
            '',
            None,
            sum(d.touching for d in desk),
            False,
        ),
        _bare_table_bar(frames / 'hand'),
        *_topdown_bars(frames / 'topdown'),
        *_hand_bars(frames / 'hand'),
    ]


def _topdown_bars(folder: Path) -> list[report.Bar]:
    pixels, metres = [], []
    for color in sorted(folder.glob('single_object*_color.png')):
        frame = read_frame(color, Path(str(color).replace('color', 'depth')))
        label = cv2.imread(str(color).replace('color', 'label'), cv2.IMREAD_UNCHANGED)
        assert label is not None
        camera = read_intrinsics(folder / 'intrinsics.json', label.shape)
        table, perception = look_at(frame, camera)
        assert perception.background is not None
        truth = np.argwhere(label > 0).mean(axis=0)
        middles = [
            np.mean(np.divmod(each.pixels, label.shape[1]), axis=1)
            for each in table.unknown_objects
        ]
        off = min(float(np.hypot(*(m - truth))) for m in middles)
        depth = float(np.nanmedian(frame.depth[label > 0]))
        pixels.append(off)
        metres.append(off * depth / camera.fx * 1e3)
    name = 'real top view: centroid error'
    return [
        report.Bar(f'{name}, mean', float(np.mean(pixels)), None, 'px', None, len(pixels)),
        report.Bar(f'{name}, median', float(np.median(metres)), 4.0, 'mm', None, len(metres)),
        report.Bar(f'{name}, worst', max(metres), 15.0, 'mm', None, len(metres)),
    ]


def _bare_table_bar(folder: Path) -> report.Bar:
    """False things on a bare table; the board at its edge, 7 cm high, is one."""
    frame = read_frame(folder / 'empty_table_0_color.png', folder / 'empty_table_0_depth.png')
    camera = read_intrinsics(folder / 'intrinsics.json', frame.depth.shape)
    things = look_at(frame, camera)[0].unknown_objects
    false = [each for each in things if each.shape.height < 0.05]
    return report.Bar('real bare table: false things', len(false), 0, '')


def _hand_bars(folder: Path) -> list[report.Bar]:
    """Share of the red glove that lies in the hand's mask."""
    empty = read_frame(folder / 'empty_table_0_color.png', folder / 'empty_table_0_depth.png')
    camera = read_intrinsics(folder / 'intrinsics.json', empty.depth.shape)
    shares = []
    for color in sorted(folder.glob('human_*_color.png')):
        frame = read_frame(color, Path(str(color).replace('color', 'depth')))
        table, _ = look_at(frame, camera, empty)
        red = frame.rgb[:, :, 0].astype(int) - frame.rgb[:, :, 1] > 60
        opened = cv2.morphologyEx(red.astype(np.uint8), cv2.MORPH_OPEN, np.ones((9, 9)))
        _, labels, stats, _ = cv2.connectedComponentsWithStats(opened)
        glove = labels == 1 + int(np.argmax(stats[1:, cv2.CC_STAT_AREA]))
        shares.append(float(mask_of(table.hand, frame.depth.shape)[glove].mean()))
    name = 'real gloved hand: share of the glove found, mean'
    return [report.Bar(name, float(np.mean(shares)), 0.9, '', None, len(shares), False)]


def main() -> None:
    """Measure, and print the table or JSON."""
    report.option_parser('perception').parse_args()
    cv2.setNumThreads(1)
    bars = cell_bars() + real_bars()
    if not report.publish('perception', bars, {'frames': 'cell at 30 Hz, 640x480, Kinect model'}):
        sys.exit(1)


if __name__ == '__main__':
    main()

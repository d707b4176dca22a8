"""`bag.sh export --format lerobot`: bags as a LeRobot dataset, layout v3.0.

One bag is one episode, with its own data file and one video for each camera:

    meta/info.json  meta/stats.json  meta/tasks.parquet  meta/episodes/chunk-000/file-000.parquet
    data/chunk-000/file-000.parquet
    videos/observation.images.color/chunk-000/file-000.mp4

`observation.state` holds the joint positions, `action` those of the next frame (of the same frame
at the end), the command that a position controller would have had. Depth becomes a video in false
colours, for viewing; its values stay in the bag. Sizes are those of the videos, which are even.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from likeme_bags.errors import BagError
from likeme_bags.export_result import Exported
from likeme_bags.lerobot_frames import EpisodeSource, episode_source, frames
from likeme_bags.lerobot_meta import (
    CHUNK_SIZE,
    DATA_PATH,
    EPISODES_PATH,
    VIDEO_PATH,
    RunningStatistics,
    dataset_info,
    tasks_table,
    vector_stats,
)
from likeme_bags.reading import open_bag
from likeme_bags.text_output import json_text
from likeme_bags.videos import Video


def export_lerobot(
    bags: Sequence[Path],
    folder: Path,
    topics: Collection[str] | None = None,
    fps: int = 30,
    tasks: Sequence[str] = (),
) -> Exported:
    """Write a dataset into `folder`.

    topics: of cameras and joints; None: all. tasks: what was done in each bag, one for all or one
    each; else the bags' names.

    Raises:
        BagError: a bag has no camera, or bags differ in their cameras, image sizes or joints.
    """
    if len(tasks) not in (0, 1, len(bags)):
        raise BagError(f'Expected one task, or one for each of {len(bags)}, got {len(tasks)}.')
    named = [*tasks] if len(tasks) == len(bags) else [(tasks or [b.stem])[0] for b in bags]
    writer = _Dataset(folder, fps, sorted(set(named)))
    complete, remarks = True, list[str]()
    for number, path in enumerate(bags):
        with open_bag(path) as bag:
            source = episode_source(bag, fps, topics)
            writer.add(source, number, named[number])
            complete = complete and bag.complete
            remarks += [f'{path.name}: {each}' for each in (*source.remarks, *bag.warnings)]
    writer.finish()
    return Exported([folder], remarks, complete)


class _Dataset:
    """Writes episodes one by one, and the files in meta/ at the end."""

    def __init__(self, folder: Path, fps: int, tasks: list[str]) -> None:
        self._folder, self._fps, self._tasks = folder, fps, tasks
        self._rows: list[dict[str, Any]] = []
        self._total = 0
        self._layout: tuple[Any, ...] = ()
        self._statistics: dict[str, RunningStatistics] = {}
        self._features: dict[str, tuple[int, ...]] = {}
        self._joint_names: tuple[str, ...] = ()

    def add(self, source: EpisodeSource, number: int, task: str) -> None:
        """One episode: its videos, its data file, its row in the table of episodes."""
        layout = tuple(source.cameras), source.joint_names
        if self._layout and layout != self._layout:
            raise BagError(
                f'Expected cameras and joints {self._layout} in {source.bag.path.name}, '
                f'got {layout}.'
            )
        self._layout, self._joint_names = layout, source.joint_names
        place = {'chunk_index': number // CHUNK_SIZE, 'file_index': number % CHUNK_SIZE}
        joints, stats = self._write_videos(source, place)
        count = len(joints)
        columns = self._columns(joints, number, self._tasks.index(task))
        _write_table(columns, self._folder / DATA_PATH.format(**place))
        for name, values in columns.items():
            stats[name] = vector_stats(values)
            self._statistics.setdefault(name, RunningStatistics()).add(values)
        self._rows.append(
            {
                'episode_index': number,
                'tasks': [task],
                'length': count,
                'data/chunk_index': place['chunk_index'],
                'data/file_index': place['file_index'],
                'dataset_from_index': self._total,
                'dataset_to_index': self._total + count,
                **self._video_rows(source, place, count),
                **{f'stats/{f}/{k}': v for f, s in stats.items() for k, v in s.items()},
                'meta/episodes/chunk_index': 0,
                'meta/episodes/file_index': 0,
            }
        )
        self._total += count

    def _video_rows(
        self, source: EpisodeSource, place: dict[str, int], count: int
    ) -> dict[str, Any]:
        rows: dict[str, Any] = {}
        for name in source.cameras:
            key = f'videos/observation.images.{name}'
            rows[f'{key}/chunk_index'] = place['chunk_index']
            rows[f'{key}/file_index'] = place['file_index']
            rows[f'{key}/from_timestamp'] = 0.0
            rows[f'{key}/to_timestamp'] = count / self._fps
        return rows

    def _write_videos(
        self, source: EpisodeSource, place: dict[str, int]
    ) -> tuple[list[NDArray[np.float32]], dict[str, dict[str, Any]]]:
        """All frames into videos; joint positions, and statistics of the images."""
        joints, seen = [], {name: RunningStatistics() for name in source.cameras}
        with ExitStack() as stack:
            videos = {}
            for name in source.cameras:
                key = f'observation.images.{name}'
                path = self._folder / VIDEO_PATH.format(video_key=key, **place)
                path.parent.mkdir(parents=True, exist_ok=True)
                videos[name] = stack.enter_context(Video(path, self._fps))
            for frame in frames(source):
                joints.append(frame.joints)
                for name, rgb in frame.images.items():
                    videos[name].write(rgb)
                    # Every 8th pixel is enough for the statistics.
                    seen[name].add(rgb[::8, ::8].reshape(-1, 3) / 255.0)
        stats = {}
        for name, statistics in seen.items():
            key = f'observation.images.{name}'
            stats[key] = statistics.of_images()
            shape = *videos[name].shape, 3
            if self._features.setdefault(key, shape) != shape:
                raise BagError(
                    f'Expected images of {self._features[key]} on {source.cameras[name]} in '
                    f'{source.bag.path.name}, got {shape}.'
                )
            self._statistics.setdefault(key, RunningStatistics()).join(statistics)
        return joints, stats

    def _columns(
        self, joints: list[NDArray[np.float32]], number: int, task: int
    ) -> dict[str, NDArray[Any]]:
        count = len(joints)
        columns: dict[str, NDArray[Any]] = {}
        if self._joint_names:
            state = np.stack(joints)
            columns['observation.state'] = state
            columns['action'] = np.concatenate([state[1:], state[-1:]])
        columns['timestamp'] = (np.arange(count) / self._fps).astype(np.float32)
        columns['frame_index'] = np.arange(count, dtype=np.int64)
        columns['episode_index'] = np.full(count, number, np.int64)
        columns['index'] = self._total + np.arange(count, dtype=np.int64)
        columns['task_index'] = np.full(count, task, np.int64)
        return columns

    def finish(self) -> None:
        """Write meta/."""
        meta = self._folder / 'meta'
        episodes = self._folder / EPISODES_PATH.format(chunk_index=0, file_index=0)
        episodes.parent.mkdir(parents=True, exist_ok=True)
        pq.write_table(pa.Table.from_pylist(self._rows), episodes)
        pq.write_table(tasks_table(self._tasks), meta / 'tasks.parquet')
        stats = {
            name: m.of_images() if name in self._features else m.of_vectors()
            for name, m in self._statistics.items()
        }
        _write_json(meta / 'stats.json', stats)
        document = dataset_info(
            self._fps,
            len(self._rows),
            self._total,
            len(self._tasks),
            self._features,
            self._joint_names,
        )
        _write_json(meta / 'info.json', document)


def _write_table(columns: dict[str, NDArray[Any]], path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    arrays = {}
    for name, values in columns.items():
        flat = pa.array(values.reshape(-1))
        width = values.shape[1] if values.ndim == 2 else 0
        arrays[name] = pa.FixedSizeListArray.from_arrays(flat, width) if width else flat
    pq.write_table(pa.table(arrays), path)


def _write_json(path: Path, document: Any) -> None:
    path.write_text(json_text(document, indent=4) + '\n', encoding='utf-8')

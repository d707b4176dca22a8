"""The metadata of a LeRobot dataset, layout v3.0: info.json, tasks, statistics."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

CHUNK_SIZE = 1000
DATA_PATH = 'data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet'
VIDEO_PATH = 'videos/{video_key}/chunk-{chunk_index:03d}/file-{file_index:03d}.mp4'
EPISODES_PATH = 'meta/episodes/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet'


class RunningStatistics:
    """Minimum, maximum, mean and standard deviation of rows of equal width.

    Each column is taken over its finite values; NaN where it has none.
    """

    def __init__(self) -> None:
        self._rows = 0
        # Of each column: count, sum and sum of squares of the finite values, shape (3, k).
        self._sums: NDArray[Any] = np.zeros((3, 1))
        self._low: Any = np.inf
        self._high: Any = -np.inf

    def add(self, rows: NDArray[Any]) -> None:
        """Take in rows, shape (n,) or (n, k)."""
        table = np.asarray(rows, np.float64).reshape(len(rows), -1)
        finite = np.isfinite(table)
        there = np.where(finite, table, 0)
        other = RunningStatistics()
        with np.errstate(over='ignore'):
            other._sums = np.stack([finite.sum(0), there.sum(0), (there**2).sum(0)])
        other._rows = len(table)
        other._low = np.where(finite, table, np.inf).min(0)
        other._high = np.where(finite, table, -np.inf).max(0)
        self.join(other)

    def join(self, other: RunningStatistics) -> None:
        """Take in what another has seen."""
        self._rows += other._rows
        self._sums = self._sums + other._sums
        self._low = np.minimum(self._low, other._low)
        self._high = np.maximum(self._high, other._high)

    def of_vectors(self) -> dict[str, Any]:
        """min, max, mean, std of shape (k,), and count (1,)."""
        count, total, squares = self._sums
        with np.errstate(invalid='ignore', divide='ignore', over='ignore'):
            mean = total / count
            # Rounding can leave a variance a little below 0.
            std = np.sqrt(np.maximum(squares / count - mean**2, 0))
        parts = {'min': self._low, 'max': self._high, 'mean': mean, 'std': std}
        stats = {name: np.where(count > 0, x, np.nan).tolist() for name, x in parts.items()}
        return {**stats, 'count': [self._rows]}

    def of_images(self) -> dict[str, Any]:
        """The same of shape (3, 1, 1), a value a channel, 0 .. 1."""
        stats = self.of_vectors()
        return {k: v if k == 'count' else [[[x]] for x in v] for k, v in stats.items()}


def vector_stats(values: NDArray[Any]) -> dict[str, Any]:
    """Statistics of one episode's column."""
    statistics = RunningStatistics()
    statistics.add(values)
    return statistics.of_vectors()


def tasks_table(tasks: Sequence[str]) -> pa.Table:
    """Tasks and their numbers; read by pandas, the task is the index, as LeRobot expects."""
    table = pa.table({'task_index': pa.array(range(len(tasks)), pa.int64()), 'task': [*tasks]})
    columns = [
        {'name': 'task_index', 'field_name': 'task_index', 'pandas_type': 'int64'},
        {'name': 'task', 'field_name': 'task', 'pandas_type': 'unicode'},
    ]
    kinds = {'task_index': 'int64', 'task': 'object'}
    pandas = {
        'index_columns': ['task'],
        'column_indexes': [],
        'columns': [{**c, 'numpy_type': kinds[c['name']], 'metadata': None} for c in columns],
        'pandas_version': '2.0.0',
    }
    return table.replace_schema_metadata({'pandas': json.dumps(pandas)})


def dataset_info(
    fps: int,
    episodes: int,
    total_frames: int,
    tasks: int,
    cameras: Mapping[str, tuple[int, ...]],
    joints: Sequence[str],
) -> dict[str, Any]:
    """info.json; cameras: feature name to (H, W, 3)."""
    features: dict[str, Any] = {}
    for name, shape in cameras.items():
        features[name] = {
            'dtype': 'video',
            'shape': [*shape],
            'names': ['height', 'width', 'channels'],
            'info': {
                'video.height': shape[0],
                'video.width': shape[1],
                'video.codec': 'mpeg4',
                'video.pix_fmt': 'yuv420p',
                'video.is_depth_map': False,
                'video.fps': fps,
                'video.channels': 3,
                'has_audio': False,
            },
        }
    if joints:
        for name in ('observation.state', 'action'):
            features[name] = {'dtype': 'float32', 'shape': [len(joints)], 'names': [*joints]}
    for name in ('timestamp', 'frame_index', 'episode_index', 'index', 'task_index'):
        kind = 'float32' if name == 'timestamp' else 'int64'
        features[name] = {'dtype': kind, 'shape': [1], 'names': None}
    return {
        'codebase_version': 'v3.0',
        'robot_type': 'likeme',
        'total_episodes': episodes,
        'total_frames': total_frames,
        'total_tasks': tasks,
        'chunks_size': CHUNK_SIZE,
        'data_files_size_in_mb': 100,
        'video_files_size_in_mb': 200,
        'fps': fps,
        'splits': {'train': f'0:{episodes}'},
        'data_path': DATA_PATH,
        'video_path': VIDEO_PATH,
        'features': features,
    }

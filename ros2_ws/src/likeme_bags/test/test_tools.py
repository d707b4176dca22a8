"""scripts/bag.sh: what the commands print, write, and answer."""

from __future__ import annotations

import csv
import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest
from rosbags.rosbag2 import Reader
from sample_bags import BEGIN, CHATTER, COLOUR, KINDS, PERIOD, sample_records
from sample_bags import DEPTH as DEPTH_TOPIC
from typer.testing import CliRunner, Result

from likeme_bags.bag_console import app
from likeme_bags.images import IMAGE, DecodedImage, image_record
from likeme_bags.reading import open_bag
from likeme_bags.typestores import jazzy
from likeme_bags.values import Record, Topic
from likeme_bags.writing import BagWriter

ROOT = Path(__file__).parents[4]
JOINTS = 'sensor_msgs/msg/JointState'


def bag(*words: object) -> Result:
    return CliRunner().invoke(app, [str(word) for word in words])


def files_of(path: Path) -> dict[str, bytes]:
    return {p.name: p.read_bytes() for p in (path.iterdir() if path.is_dir() else [path])}


def test_the_script_speaks_and_counts(mcap: Path) -> None:
    done = subprocess.run(
        [ROOT / 'scripts' / 'bag.sh', 'info', mcap], capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 0, done.stderr
    assert '60 messages in 0.633 s, from 2023-11-14 22:13:20 UTC' in done.stdout
    gone = subprocess.run(
        [ROOT / 'scripts' / 'bag.sh', 'info', '/nowhere'],
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert (gone.returncode, gone.stderr) == (1, 'bag: There is no bag /nowhere.\n')


def test_info_counts_and_warns(mcap: Path) -> None:
    summary = json.loads(bag('info', mcap, '--json').stdout)
    assert (summary['messages'], summary['complete']) == (60, True)
    assert {t['name']: t['messages'] for t in summary['topics']} == {
        CHATTER: 20,
        COLOUR: 20,
        DEPTH_TOPIC: 20,
    }
    assert abs(summary['topics'][0]['rate'] - 30) < 0.01
    file = next(mcap.glob('*.mcap'))
    file.write_bytes(file.read_bytes()[:-3000])
    short = bag('info', mcap)
    assert short.exit_code == 1
    assert 'bag: messages are missing, or may be.' in short.stderr


@pytest.mark.parametrize('kind', KINDS)
@pytest.mark.parametrize('storage', ['mcap', 'sqlite3'])
def test_cut_keeps_what_it_should(
    sample: Callable[[str], Path], written: list[Record], tmp_path: Path, kind: str, storage: str
) -> None:
    source = sample(kind)
    before = files_of(source)
    out = tmp_path / 'out'
    words = ('--start', 0.1, '--end', 0.3, '--topics', CHATTER, '--topics', COLOUR.strip('/'))
    done = bag('cut', source, '--out', out, *words, '--storage', storage)
    assert done.exit_code == 0, done.stderr
    kept = [
        r
        for r in written
        if r.topic in (CHATTER, COLOUR) and BEGIN + 10**8 <= r.stamp < BEGIN + 3 * 10**8
    ]
    with open_bag(out) as bag_out, open_bag(source) as bag_in:
        assert list(bag_out.records()) == kept
        old = {t.name: t for t in bag_in.topics}
        for topic in bag_out.topics:
            assert topic.counted(20) == old[topic.name]
    with Reader(out) as reader:
        assert reader.message_count == len(list(reader.messages())) == len(kept)
    assert files_of(source) == before


def test_merge_is_in_order_of_time(tmp_path: Path, written: list[Record]) -> None:
    for k in range(3):
        with BagWriter(tmp_path / f'{k}', 'sqlite3' if k else 'mcap') as writer:
            for record in written[k::3]:
                writer.add(Topic(record.topic, record.type))
                writer.write(record)
    done = bag('merge', *(tmp_path / f'{k}' for k in range(3)), '--out', tmp_path / 'all')
    assert done.exit_code == 0, done.stderr
    with open_bag(tmp_path / 'all') as merged:
        assert list(merged.records()) == written
    assert bag('merge', tmp_path / '0', '--out', tmp_path / 'x').exit_code == 2


def test_merge_refuses_two_types_on_a_topic(tmp_path: Path, written: list[Record]) -> None:
    for k in range(2):
        record = written[k]._replace(topic='/a')
        with BagWriter(tmp_path / f'{k}') as writer:
            writer.add(Topic('/a', record.type))
            writer.write(record)
    done = bag('merge', tmp_path / '0', tmp_path / '1', '--out', tmp_path / 'all')
    assert done.exit_code == 1
    assert (
        'Expected /a to be std_msgs/msg/String, got sensor_msgs/msg/Image as well.' in done.stderr
    )
    assert not (tmp_path / 'all').exists()


@pytest.mark.parametrize('kind', KINDS)
def test_repair_of_a_cut_bag_loses_nothing_that_is_there(
    sample: Callable[[str], Path], written: list[Record], kind: str
) -> None:
    source = sample(kind)
    if source.is_dir():
        (source / 'metadata.yaml').unlink()
        file = next(source.iterdir())
    else:
        file = source
    data = file.read_bytes()
    file.write_bytes(data[: len(data) * 2 // 3])
    before = files_of(source)
    with open_bag(source) as cut_bag:
        readable = list(cut_bag.records())
    done = bag('repair', source)
    assert files_of(source) == before
    mended = source.with_name(f'{source.stem}_repaired')
    with open_bag(mended) as new:
        records = list(new.records())
        assert new.complete
        assert new.warnings == ()
    assert set(readable) <= set(records) <= set(written)
    assert len(records) > 15
    # sqlite3 lost pages in the middle of its trees; the others only an end never written.
    assert done.exit_code == int(kind == 'sqlite3'), done.stderr


def test_repair_in_place_keeps_the_original(mcap: Path, written: list[Record]) -> None:
    assert 'nothing to repair' in bag('repair', mcap).stdout
    (mcap / 'metadata.yaml').unlink()
    before = files_of(mcap)
    done = bag('repair', mcap, '--in-place')
    assert done.exit_code == 0, done.stderr
    with open_bag(mcap) as mended:
        assert list(mended.records()) == written
        assert mended.warnings == ()
    assert files_of(mcap.with_name('sample.before')) == before


def test_repair_corrects_metadata_that_is_wrong(mcap: Path, written: list[Record]) -> None:
    file = mcap / 'metadata.yaml'
    file.write_text(file.read_text().replace('message_count: 60', 'message_count: 59'))
    done = bag('repair', mcap)
    assert done.exit_code == 0, done.stderr
    assert '60 messages found, metadata.yaml says 59.' in done.stderr
    with open_bag(mcap.with_name('sample_repaired')) as mended:
        assert list(mended.records()) == written
        assert mended.warnings == ()


def test_a_target_that_exists_is_left_alone(mcap: Path, tmp_path: Path) -> None:
    (tmp_path / 'there').mkdir()
    (tmp_path / 'there' / 'precious').write_text('x')
    for words in (('cut', mcap), ('merge', mcap, mcap), ('export', mcap, '--format', 'csv')):
        done = bag(*words, '--out', tmp_path / 'there')
        assert done.exit_code == 1
        assert 'exists' in done.stderr
    assert (tmp_path / 'there' / 'precious').read_text() == 'x'


def test_export_csv(mcap: Path, tmp_path: Path) -> None:
    done = bag('export', mcap, '--format', 'csv', '--out', tmp_path / 'csv')
    assert done.exit_code == 0, done.stderr
    with (tmp_path / 'csv' / 'camera-rgb-image_rect_color.csv').open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 20
    assert rows[1]['log_time'] == str(BEGIN + PERIOD + 1)
    assert rows[1]['header.stamp'] == str(BEGIN + PERIOD)
    assert (rows[1]['height'], rows[1]['encoding'], rows[1]['data']) == ('12', 'rgb8', '576 items')


def arm_bag(folder: Path, frames: int = 31) -> Path:
    """A camera whose picture grows brighter, and two joints that move, for a second."""
    types = jazzy().types
    with BagWriter(folder) as writer:
        for name, kind in ((COLOUR, IMAGE), (DEPTH_TOPIC, IMAGE), ('/joint_states', JOINTS)):
            writer.add(Topic(name, kind))
        for k in range(frames):
            stamp = BEGIN + round(k * 1e9 / 30)
            rgb = np.full((48, 64, 3), 8 * k, np.uint8)
            depth = np.full((48, 64), 800, np.uint16)
            writer.write(image_record(COLOUR, stamp, DecodedImage(stamp, 'c', 'rgb8', rgb)))
            writer.write(
                image_record(DEPTH_TOPIC, stamp, DecodedImage(stamp, 'c', '16UC1', depth))
            )
            header = types['std_msgs/msg/Header'](
                types['builtin_interfaces/msg/Time'](*divmod(stamp, 10**9)), ''
            )
            joints = types[JOINTS](
                header, ['a', 'b'], np.array([0.1 * k, -0.1 * k]), np.zeros(0), np.zeros(0)
            )
            data = bytes(jazzy().serialize_cdr(joints, JOINTS))
            writer.write(Record('/joint_states', JOINTS, stamp, data))
    return folder


def brightness(path: Path) -> list[float]:
    video = cv2.VideoCapture(str(path))
    values = []
    while True:
        there, frame = video.read()
        if not there:
            return values
        values.append(float(frame.mean()))


def test_export_mp4(tmp_path: Path) -> None:
    source = arm_bag(tmp_path / 'arm')
    done = bag('export', source, '--format', 'mp4', '--out', tmp_path / 'mp4')
    assert done.exit_code == 0, done.stderr
    seen = brightness(tmp_path / 'mp4' / f'{COLOUR.strip("/").replace("/", "-")}.mp4')
    assert len(seen) == 31
    np.testing.assert_allclose(seen, 8 * np.arange(31), atol=6)
    assert len(brightness(tmp_path / 'mp4' / 'camera-depth-image.mp4')) == 31


def test_export_lerobot(tmp_path: Path) -> None:
    pq = pytest.importorskip('pyarrow.parquet')
    """Files and columns of layout v3.0: two episodes of one task."""
    bags = [arm_bag(tmp_path / 'one'), arm_bag(tmp_path / 'two', frames=16)]
    out = tmp_path / 'set'
    done = bag('export', *bags, '--format', 'lerobot', '--out', out, '--task', 'wave')
    assert done.exit_code == 0, done.stderr
    info = json.loads((out / 'meta' / 'info.json').read_text())
    assert (info['codebase_version'], info['fps']) == ('v3.0', 30)
    assert (info['total_episodes'], info['total_frames'], info['total_tasks']) == (2, 47, 1)
    assert set(info['features']) == {
        'observation.images.color', 'observation.images.depth', 'observation.state', 'action',
        'timestamp', 'frame_index', 'episode_index', 'index', 'task_index',
    }  # fmt: skip
    assert info['features']['observation.state']['names'] == ['a', 'b']
    episodes = pq.read_table(out / 'meta/episodes/chunk-000/file-000.parquet').to_pylist()
    assert [e['length'] for e in episodes] == [31, 16]
    assert [(e['dataset_from_index'], e['dataset_to_index']) for e in episodes] == [
        (0, 31),
        (31, 47),
    ]
    assert episodes[1]['tasks'] == ['wave']
    for episode in episodes:
        place = {
            'chunk_index': episode['data/chunk_index'],
            'file_index': episode['data/file_index'],
        }
        table = pq.read_table(out / info['data_path'].format(**place)).to_pydict()
        count = episode['length']
        np.testing.assert_allclose(table['timestamp'], np.arange(count) / 30, atol=1e-6)
        state, action = np.array(table['observation.state']), np.array(table['action'])
        np.testing.assert_allclose(state[:, 0], 0.1 * np.arange(count), atol=1e-6)
        np.testing.assert_array_equal(action[:-1], state[1:])
        video = info['video_path'].format(video_key='observation.images.color', **place)
        seen = brightness(out / video)
        np.testing.assert_allclose(seen, 8 * np.arange(count), atol=6)
    tasks = pq.read_table(out / 'meta' / 'tasks.parquet').to_pylist()
    assert tasks == [{'task_index': 0, 'task': 'wave'}]
    stats = json.loads((out / 'meta' / 'stats.json').read_text())
    assert np.shape(stats['observation.images.color']['mean']) == (3, 1, 1)
    np.testing.assert_allclose(stats['observation.state']['max'], [3.0, 0.0], atol=1e-5)


def test_only_the_export_that_needs_pyarrow_asks_for_it(tmp_path: Path, mcap: Path) -> None:
    # A module that is None in sys.modules cannot be imported.
    code = (
        "import sys; sys.modules['pyarrow'] = None\n"
        'from likeme_bags.bag_console import app; app(sys.argv[1:])'
    )

    def without_pyarrow(*words: object) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, '-c', code, *map(str, words)]
        return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)

    assert '60 messages' in without_pyarrow('info', mcap).stdout
    refused = without_pyarrow('export', mcap, '--format', 'lerobot', '--out', tmp_path / 'out')
    assert (refused.returncode, refused.stderr) == (
        1,
        'bag: Expected the Python package pyarrow for --format lerobot: '
        'install it from pip (python3 -m pip install pyarrow).\n',
    )
    assert not (tmp_path / 'out').exists()


def test_exports_that_have_nothing_to_write(tmp_path: Path, written: list[Record]) -> None:
    with BagWriter(tmp_path / 'text') as writer:
        writer.add(Topic(CHATTER, written[0].type))
        writer.write(written[0])
    for form, sentence in (
        ('mp4', 'Expected a topic of images'),
        ('lerobot', 'Expected a camera'),
    ):
        if form == 'lerobot':
            pytest.importorskip('pyarrow')
        done = bag('export', tmp_path / 'text', '--format', form, '--out', tmp_path / form)
        assert done.exit_code == 1
        assert sentence in done.stderr
        assert not (tmp_path / form).exists()
    assert sample_records(1) != sample_records(2)

"""Exports of bags with unusual names, sizes, numbers and clocks."""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from sample_bags import BEGIN, STRING, text_record
from typer.testing import CliRunner, Result

from likeme_bags.bag_console import app
from likeme_bags.images import DecodedImage, image_record
from likeme_bags.typestores import jazzy
from likeme_bags.values import Record, Topic
from likeme_bags.writing import BagWriter

STEP = 33_333_333
JOINTS = 'sensor_msgs/msg/JointState'


def bag(*words: object) -> Result:
    if 'lerobot' in words:
        pytest.importorskip('pyarrow')
    done = CliRunner().invoke(app, [str(word) for word in words])
    assert done.exception is None or isinstance(done.exception, SystemExit), done.exception
    return done


def write(path: Path, records: Sequence[Record]) -> Path:
    with BagWriter(path) as writer:
        for record in records:
            writer.add(Topic(record.topic, record.type))
            writer.write(record)
    return path


def grey(topic: str, stamp: int, value: int, size: tuple[int, int] = (16, 16)) -> Record:
    pixels = np.full((*size, 3), value, np.uint8)
    # A header's stamp ends in 2038.
    return image_record(topic, stamp, DecodedImage(min(stamp, 2 * 10**18), 'c', 'rgb8', pixels))


def joints(topic: str, stamp: int, positions: Mapping[str, float]) -> Record:
    types = jazzy().types
    header = types['std_msgs/msg/Header'](
        types['builtin_interfaces/msg/Time'](*divmod(stamp, 10**9)), ''
    )
    message = types[JOINTS](
        header, list(positions), np.array([*positions.values()]), np.zeros(0), np.zeros(0)
    )
    return Record(topic, JOINTS, stamp, bytes(jazzy().serialize_cdr(message, JOINTS)))


def frames_of(path: Path) -> list[NDArray[Any]]:
    video = cv2.VideoCapture(str(path))
    frames = []
    while True:
        there, frame = video.read()
        if not there:
            return frames
        frames.append(frame)


def export(path: Path, form: str, *words: object) -> tuple[Path, Result]:
    out = path.with_name(f'{path.name}_{form}')
    return out, bag('export', path, '--format', form, '--out', out, *words)


@pytest.mark.parametrize(
    'names', [('/tf', 'tf'), ('/a/b', '/a-b'), ('/Cam', '/cam'), ('/x', '/X/', '/x-2')]
)
def test_topics_of_one_file_name_are_written_apart(tmp_path: Path, names: Sequence[str]) -> None:
    records = [text_record(name, BEGIN + k, name) for name in names for k in range(3)]
    out, done = export(write(tmp_path / 'text', records), 'csv')
    assert done.exit_code == 0, done.stderr
    files = [Path(line) for line in done.stdout.splitlines()]
    assert len({file.name.lower() for file in files}) == len(names)
    found = set()
    for file in files:
        assert file.parent == out
        with file.open() as lines:
            rows = [row['data'] for row in csv.DictReader(lines)]
        assert len(rows) == 3
        assert len(set(rows)) == 1
        found.add(rows[0])
    assert found == set(names)
    assert 'because another topic has that name' in done.stderr
    images = [grey(name, BEGIN + k * STEP, 60 * n) for k in range(9)
              for n, name in enumerate(names)]  # fmt: skip
    out, done = export(write(tmp_path / 'images', images), 'mp4')
    assert done.exit_code == 0, done.stderr
    seen = [frames_of(file)[0].mean() for file in out.iterdir()]
    np.testing.assert_allclose(sorted(seen), 60 * np.arange(len(names)), atol=4)


def test_cameras_of_one_name_stay_two(tmp_path: Path) -> None:
    names = ('/left/cam_image', '/left_cam/image', '/Left/cam/image', '/color',
             '/camera/color/image_raw')  # fmt: skip
    records = [grey(name, BEGIN + k * STEP, 50 * n) for k in range(9)
               for n, name in enumerate(names)]  # fmt: skip
    out, done = export(write(tmp_path / 'cams', records), 'lerobot')
    assert done.exit_code == 0, done.stderr
    videos = {
        path.name: frames_of(path / 'chunk-000' / 'file-000.mp4')[0].mean()
        for path in (out / 'videos').iterdir()
    }
    assert len({name.lower() for name in videos}) == len(names)
    np.testing.assert_allclose(sorted(videos.values()), 50 * np.arange(5), atol=4)
    info = json.loads((out / 'meta' / 'info.json').read_text())
    assert set(videos) == {name for name in info['features'] if 'images' in name}


def test_names_that_are_no_file_names(tmp_path: Path) -> None:
    names = ['/', '/../up', '/a b:c', '/' + 'x' * 300, '/' + 'x' * 300 + 'y', '\n']
    source = write(tmp_path / 'text', [text_record(name, BEGIN, name) for name in names])
    out, done = export(source, 'csv')
    assert done.exit_code == 0, done.stderr
    assert len(list(out.iterdir())) == len(names)
    assert {path.name for path in tmp_path.iterdir()} == {'text', 'text_csv'}
    assert len(bag('info', source).stdout.splitlines()) == 2 + len(names)


def test_a_field_called_as_the_column_of_log_times(tmp_path: Path) -> None:
    topic = Topic('/x', 'p/msg/T', definition='int32 log_time\nint32 a\n', encoding='ros2msg')
    with BagWriter(tmp_path / 'own') as writer:
        writer.add(topic)
        writer.write(Record('/x', 'p/msg/T', BEGIN, b'\0\1\0\0\7\0\0\0\1\0\0\0'))
    out, done = export(tmp_path / 'own', 'csv')
    assert done.exit_code == 0, done.stderr
    assert (out / 'x.csv').read_text().splitlines() == ['log_time,log_time_2,a', f'{BEGIN},7,1']


@pytest.mark.parametrize('size', [(61, 79), (61, 80), (60, 79), (1, 1)])
def test_odd_sizes_are_padded(tmp_path: Path, size: tuple[int, int]) -> None:
    """Nothing is cut off, and the dataset says the size that its videos have."""
    even = tuple(n + n % 2 for n in size)
    source = write(tmp_path / 'odd', [grey('/cam', BEGIN + k * STEP, 90, size) for k in range(9)])
    out, done = export(source, 'mp4')
    assert done.exit_code == 0, done.stderr
    frame = frames_of(out / 'cam.mp4')[0]
    assert frame.shape[:2] == even
    assert abs(frame[-1].mean() - 90) < 6
    assert abs(frame[:, -1].mean() - 90) < 6
    out, done = export(source, 'lerobot')
    assert done.exit_code == 0, done.stderr
    feature = json.loads((out / 'meta/info.json').read_text())['features'][
        'observation.images.cam'
    ]
    assert feature['shape'] == [*even, 3]
    assert (feature['info']['video.height'], feature['info']['video.width']) == even
    video = next((out / 'videos').rglob('*.mp4'))
    assert frames_of(video)[0].shape == (*even, 3)


def test_episodes_of_two_image_sizes_are_refused(tmp_path: Path) -> None:
    bags = [
        write(tmp_path / f'{n}', [grey('/cam', BEGIN + k * STEP, 9, (n, 16)) for k in range(9)])
        for n in (16, 24)
    ]
    done = bag('export', *bags, '--format', 'lerobot', '--out', tmp_path / 'out')
    assert done.exit_code == 1
    assert 'Expected images of (16, 16, 3) on /cam in 24, got (24, 16, 3).' in done.stderr
    assert not (tmp_path / 'out').exists()


def strict(text: str) -> Any:
    def refuse(word: str) -> None:
        raise AssertionError(f'{word} is not JSON')

    return json.loads(text, parse_constant=refuse)


def test_numbers_that_json_does_not_have(tmp_path: Path) -> None:
    nan, inf = float('nan'), float('inf')
    records = [grey('/cam', BEGIN + k * STEP, 9) for k in range(9)]
    for k in range(9):
        values = {'never': nan, 'at times': nan if k < 4 else k / 10, 'far': -inf if k else 1.0}
        records.append(joints('/joints', BEGIN + k * STEP, values))
    source = write(tmp_path / 'nan', records)
    out, done = export(source, 'lerobot')
    assert done.exit_code == 0, done.stderr
    stats = strict((out / 'meta' / 'stats.json').read_text())['observation.state']
    np.testing.assert_allclose(stats['min'][1:], [0.4, 1.0], atol=1e-6)
    np.testing.assert_allclose(stats['max'][1:], [0.8, 1.0], atol=1e-6)
    np.testing.assert_allclose(stats['mean'][1:], [0.6, 1.0], atol=1e-6)
    assert [stats[name][0] for name in ('min', 'max', 'mean', 'std')] == [None] * 4
    parquet = pytest.importorskip('pyarrow.parquet')
    table = parquet.read_table(next((out / 'data').rglob('*.parquet'))).to_pydict()
    assert np.isnan(table['observation.state'][0][0])
    out, done = export(source, 'csv', '--topics', 'joints')
    with (out / 'joints.csv').open() as file:
        rows = list(csv.DictReader(file))
    assert strict(rows[1]['position']) == [None, None, None]
    assert strict(rows[5]['position'])[1] == 0.5


def test_messages_in_arrays_are_json_objects(tmp_path: Path) -> None:
    types = jazzy().types
    time = types['builtin_interfaces/msg/Time'](3, 5)
    kind, point = 'trajectory_msgs/msg/JointTrajectory', 'trajectory_msgs/msg/JointTrajectoryPoint'
    none = np.zeros(0)
    duration = types['builtin_interfaces/msg/Duration'](2, 1)
    message = types[kind](
        types['std_msgs/msg/Header'](time, 'f'), ['a'],
        [types[point](np.array([1.5, np.nan]), none, none, none, duration)],
    )  # fmt: skip
    record = Record('/t', kind, BEGIN, bytes(jazzy().serialize_cdr(message, kind)))
    out, done = export(write(tmp_path / 'points', [record]), 'csv')
    assert done.exit_code == 0, done.stderr
    with (out / 't.csv').open() as file:
        row = next(csv.DictReader(file))
    assert row['header.stamp'] == '3000000005'
    assert strict(row['points']) == [
        {'positions': [1.5, None], 'velocities': [], 'accelerations': [], 'effort': [],
         'time_from_start': 2_000_000_001}
    ]  # fmt: skip


JUMPS = {
    'the first message before the clock was set': [0],
    'two messages': [0],
    'many before the clock was set': [k * STEP for k in range(5)],
    'a clock of the far future': [2**62],
    'a day without messages': [BEGIN - 86_400 * 10**9 - 3 * STEP],
}


@pytest.mark.parametrize('kind', JUMPS)
def test_jumps_of_the_clock_are_left_out(tmp_path: Path, kind: str) -> None:
    count = 1 if kind == 'two messages' else 15
    stamps = JUMPS[kind] + [BEGIN + k * STEP for k in range(count)]
    source = write(tmp_path / 'z', [grey('/cam', stamp, 9) for stamp in stamps])
    out, done = export(source, 'mp4')
    assert done.exit_code == 0, done.stderr
    assert len(frames_of(out / 'cam.mp4')) == len(stamps)
    assert len(done.stderr.splitlines()) == 1
    assert '/cam: log times jump 1 times, by up to' in done.stderr
    out, done = export(source, 'lerobot')
    assert done.exit_code == 0, done.stderr
    info = json.loads((out / 'meta' / 'info.json').read_text())
    assert info['total_frames'] == len(stamps)
    out, done = export(source, 'csv')
    assert done.exit_code == 0, done.stderr
    rate = strict(bag('info', source, '--json').stdout)['topics'][0]['rate']
    assert rate == (0 if kind == 'two messages' else 30)
    if 'the clock was set' in kind:
        assert bag('doctor', source).exit_code == 0


def test_pauses_are_kept_and_slow_cameras_are_no_jumps(tmp_path: Path) -> None:
    stamps = [BEGIN + s * 10**9 for s in (0, 1, 2, 62, 63)]
    out, done = export(write(tmp_path / 'pause', [grey('/cam', s, 9) for s in stamps]), 'mp4')
    assert (done.exit_code, done.stderr) == (0, '')
    assert len(frames_of(out / 'cam.mp4')) == 64
    stamps = [BEGIN + k * 4000 * 10**9 for k in range(3)]
    out, done = export(write(tmp_path / 'slow', [grey('/cam', s, 9) for s in stamps]), 'mp4')
    assert (done.exit_code, done.stderr) == (0, '')
    assert len(frames_of(out / 'cam.mp4')) == 801


@pytest.mark.parametrize('stamp', [0, BEGIN])
def test_images_whose_log_times_are_all_equal(tmp_path: Path, stamp: int) -> None:
    source = write(tmp_path / 'equal', [grey('/cam', stamp, 20 * k) for k in range(9)])
    out, done = export(source, 'mp4')
    assert done.exit_code == 0
    assert '/cam: all log times are equal; images are written at 30 Hz.' in done.stderr
    seen = [frame.mean() for frame in frames_of(out / 'cam.mp4')]
    np.testing.assert_allclose(seen, 20 * np.arange(9), atol=6)
    out, done = export(source, 'lerobot')
    assert done.exit_code == 1
    assert not out.exists()


def test_too_many_frames_are_refused(tmp_path: Path) -> None:
    stamps = [BEGIN, BEGIN + 10**17]
    source = write(tmp_path / 'long', [grey('/cam', s, 9) for s in stamps])
    for form in ('mp4', 'lerobot'):
        out, done = export(source, form, '--fps', 200)
        assert done.exit_code == 1
        assert 'Expected at most 10000000 samples, got 1e+08 s at 200 Hz.' in done.stderr
        assert not out.exists()


def mixed(path: Path) -> Path:
    records = [text_record('/a', BEGIN, 'a'), text_record('/b', BEGIN + 1, 'b')]
    records += [grey(name, BEGIN + k * STEP, 9) for k in range(9) for name in ('/cam', '/eye')]
    records += [joints('/joints', BEGIN + k * STEP, {'j': 0.1}) for k in range(9)]
    return write(path, records)


def test_topics_are_chosen_by_one_rule(tmp_path: Path) -> None:
    """With and without leading slash, in every command."""
    source = mixed(tmp_path / 'mixed')
    for number, names in enumerate((['a', '/cam'], ['/a', 'cam'])):
        words = [word for name in names for word in ('--topics', name)]
        done = bag('cut', source, '--out', tmp_path / f'cut{number}', *words)
        assert done.stdout.startswith('10 messages'), done.stderr
        done = bag('export', source, '--format', 'csv', '--out', tmp_path / f'c{number}', *words)
        assert {path.name for path in (tmp_path / f'c{number}').iterdir()} == {'a.csv', 'cam.csv'}
        out = tmp_path / f'm{number}'
        done = bag('export', source, '--format', 'mp4', '--out', out, '--topics', names[1])
        assert [path.name for path in out.iterdir()] == ['cam.mp4']
        out = tmp_path / f'l{number}'
        done = bag('export', source, '--format', 'lerobot', '--out', out, '--topics', names[1])
        assert done.exit_code == 0, done.stderr
        info = json.loads((out / 'meta' / 'info.json').read_text())
        assert {name for name in info['features'] if 'obs' in name} == {'observation.images.cam'}


def test_a_relative_and_an_absolute_name_are_two_topics(tmp_path: Path) -> None:
    source = write(tmp_path / 'tf', [text_record(n, BEGIN, n) for n in ('/tf', 'tf')])
    for name in ('/tf', 'tf'):
        out = tmp_path / f'out{len(name)}'
        done = bag('export', source, '--format', 'csv', '--out', out, '--topics', name)
        assert done.exit_code == 0, done.stderr
        assert next(out.iterdir()).read_text().splitlines()[1:] == [f'{BEGIN},{name}']


REFUSED = {
    'cut: unknown topic': ('cut --topics /typo', '--topics /typo: expected topics of mixed'),
    'csv: unknown topic': ('csv --topics a --topics typo', '--topics typo: expected topics of'),
    'mp4: unknown topic': ('mp4 --topics cam --topics typo', '--topics typo: expected topics of'),
    'lerobot: unknown topic': ('lerobot --topics typo', '--topics typo: expected topics of'),
    'mp4: text': ('mp4 --topics cam --topics a', '--topics /a: expected messages of sensor_msgs'),
    'lerobot: text': ('lerobot --topics cam --topics a', '--topics /a: expected messages of'),
    'lerobot: no camera': ('lerobot --topics joints', 'Expected a camera'),
    'cut: start nan': ('cut --start nan', 'Expected --start as s from the beginning'),
    'cut: end nan': ('cut --end nan', 'Expected --end as s from the beginning'),
    'cut: start inf': ('cut --start inf', 'Expected --start as s from the beginning'),
    'cut: end -inf': ('cut --end=-inf', 'Expected --end as s from the beginning'),
    'cut: negative': ('cut --start=-1', 'Expected --start as s from the beginning'),
    'cut: reversed': ('cut --start 5 --end 2', 'Expected --start before --end, got 5.0 and 2.0 s'),
    'cut: nothing between': ('cut --start 2 --end 2', 'Expected --start before --end'),
    'cut: after the end': ('cut --start 1e300', 'Expected messages to write, got none'),
    'cut: empty part': ('cut --start 100', 'Expected messages to write, got none'),
    'lerobot: two tasks': ('lerobot --task a --task b', 'Expected one task, or one for each of 1'),
}  # fmt: skip
WRONG_USAGE = {
    'csv: task': ('csv --task a', 'expected --task with --format lerobot, got it with csv'),
    'mp4: task': ('mp4 --task a', 'expected --task with --format lerobot, got it with mp4'),
    'csv: rate': ('csv --fps 5', 'expected --fps with --format mp4 or lerobot, got it with csv'),
    'mp4: no rate': ('mp4 --fps 0', '--fps'),
    'mp4: negative rate': ('mp4 --fps -3', '--fps'),
    'mp4: rate nan': ('mp4 --fps nan', '--fps'),
    'mp4: rate too high': ('mp4 --fps 100000', '--fps'),
}


@pytest.mark.parametrize('name', REFUSED | WRONG_USAGE)
def test_options_out_of_range_are_refused(tmp_path: Path, name: str) -> None:
    source = mixed(tmp_path / 'mixed')
    line, sentence = (REFUSED | WRONG_USAGE)[name]
    form, *words = line.split()
    command = ['cut'] if form == 'cut' else ['export', '--format', form]
    done = bag(*command, source, '--out', tmp_path / 'out', *words)
    assert done.exit_code == (2 if name in WRONG_USAGE else 1)
    assert sentence in done.stderr
    if name not in WRONG_USAGE:
        assert len(done.stderr.splitlines()) == 1
    assert not (tmp_path / 'out').exists()


def test_bags_without_messages_are_not_merged(tmp_path: Path) -> None:
    for name in 'ab':
        with BagWriter(tmp_path / name) as writer:
            writer.add(Topic('/a', STRING))
    done = bag('merge', tmp_path / 'a', tmp_path / 'b', '--out', tmp_path / 'out')
    assert done.exit_code == 1
    assert 'Expected messages to write, got none' in done.stderr
    assert not (tmp_path / 'out').exists()


def test_a_second_topic_of_joints_is_said_to_be_left_out(tmp_path: Path) -> None:
    records = [grey('/cam', BEGIN + k * STEP, 9) for k in range(9)]
    for name in ('/arm', '/hand'):
        records += [joints(name, BEGIN + k * STEP, {name: 0.1}) for k in range(9)]
    source = write(tmp_path / 'two', records)
    _, done = export(source, 'lerobot')
    assert done.exit_code == 0
    assert 'two: /hand is left out: /arm gives the joints.' in done.stderr
    out = tmp_path / 'hand'
    done = bag('export', source, '--format', 'lerobot', '--out', out, '--topics', 'hand',
               '--topics', 'cam')  # fmt: skip
    assert (done.exit_code, done.stderr) == (0, '')
    info = json.loads((out / 'meta' / 'info.json').read_text())
    assert info['features']['observation.state']['names'] == ['/hand']

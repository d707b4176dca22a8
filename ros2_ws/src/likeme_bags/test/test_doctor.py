"""Each check of the doctor finds its illness, and a healthy bag is told so."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from sample_bags import STRING, text_record
from typer.testing import CliRunner

from likeme_bags.bag_console import app
from likeme_bags.camera_topics import COLOUR, DEPTH, INFO
from likeme_bags.check_results import Level
from likeme_bags.doctor import examine
from likeme_bags.images import IMAGE, DecodedImage, image_record
from likeme_bags.qos import LATCHED
from likeme_bags.typestores import jazzy
from likeme_bags.values import Record, Topic
from likeme_bags.writing import BagWriter

BEGIN, PERIOD = 1_700_000_000_000_000_000, 33_333_333
CAMERA_INFO = 'sensor_msgs/msg/CameraInfo'
BEST_EFFORT = LATCHED._replace(reliability=type(LATCHED.reliability).BEST_EFFORT)
NAMES = {'colour': f'/{COLOUR}', 'depth': f'/{DEPTH}', 'info': f'/{INFO}'}
FRAMES = 30


def picture(name: str, stamp: int, header: int, size: tuple[int, int] = (12, 16)) -> Record:
    if name == 'colour':
        image = DecodedImage(header, 'c', 'rgb8', np.zeros((*size, 3), np.uint8))
    else:
        image = DecodedImage(header, 'c', '16UC1', np.full(size, stamp // 1000 % 999, np.uint16))
    return image_record(NAMES[name], stamp, image)


def camera_info(stamp: int, size: tuple[int, int] = (12, 16)) -> Record:
    types = jazzy().types
    header = types['std_msgs/msg/Header'](
        types['builtin_interfaces/msg/Time'](*divmod(stamp, 10**9)), 'c'
    )
    roi = types['sensor_msgs/msg/RegionOfInterest'](0, 0, 0, 0, False)
    nine, twelve = np.zeros(9), np.zeros(12)
    message = types[CAMERA_INFO](
        header, *size, 'plumb_bob', np.zeros(5), nine, nine, twelve, 0, 0, roi
    )
    return Record(
        NAMES['info'], CAMERA_INFO, stamp, bytes(jazzy().serialize_cdr(message, CAMERA_INFO))
    )


def healthy() -> list[Record]:
    records = []
    for k in range(FRAMES):
        stamp = BEGIN + k * PERIOD
        records += [picture('colour', stamp, stamp), picture('depth', stamp + 1, stamp)]
        records.append(camera_info(stamp))
    return records


def write(folder: Path, records: list[Record], qos: tuple[object, ...] = (LATCHED,)) -> Path:
    with BagWriter(folder / 'bag') as writer:
        for record in records:
            writer.add(Topic(record.topic, record.type, qos=qos))  # type: ignore[arg-type]
            writer.write(record)
    return folder / 'bag'


def levels(path: Path) -> dict[str, Level]:
    return {name: result.level for name, result in examine(path).items()}


def test_a_healthy_bag(tmp_path: Path) -> None:
    results = examine(write(tmp_path, healthy()))
    assert len(results) >= 20
    assert {r.level for r in results.values()} == {Level.OK}
    done = CliRunner().invoke(app, ['doctor', str(tmp_path / 'bag')])
    assert done.exit_code == 0
    assert len(done.stdout.splitlines()) == len(results)


def without(k: int, name: str) -> Callable[[], list[Record]]:
    """The healthy records without the k-th of a topic."""
    return lambda: [
        r for r in healthy() if r != [x for x in healthy() if x.topic == NAMES[name]][k]
    ]


def moved(seconds: float) -> list[Record]:
    shift = int(seconds * 1e9)
    return [r._replace(stamp=r.stamp + shift) for r in healthy()]


def backwards() -> list[Record]:
    swapped = picture('colour', BEGIN + 2 * PERIOD, BEGIN - 5 * PERIOD)
    return [swapped if r.topic == NAMES['colour'] and r.stamp == swapped.stamp else r
            for r in healthy()]  # fmt: skip


def gap(first: int, last: int) -> list[Record]:
    lost = range(BEGIN + first * PERIOD, BEGIN + last * PERIOD)
    return [r for r in healthy() if r.stamp not in lost]


def foreign_name() -> list[Record]:
    other = '/camera/rgb/image_color'
    return [r._replace(topic=other) if r.topic == NAMES['colour'] else r for r in healthy()]


def undecodable() -> list[Record]:
    return [*healthy(), text_record('/a', BEGIN, 'x')._replace(data=b'\0\1\0\0\xff\0\0\0a')]


def untyped() -> list[Record]:
    return [*healthy(), Record('/a', 'my_msgs/msg/Own', BEGIN, b'\0\1\0\0abcd')]


def two_sizes() -> list[Record]:
    stamp = BEGIN + FRAMES * PERIOD
    return [*healthy(), picture('colour', stamp, stamp, (24, 32)), picture('depth', stamp, stamp)]


def drawn_upon() -> list[Record]:
    drawing = picture('colour', BEGIN, BEGIN, (24, 32))._replace(topic='/table_overlay')
    return [*healthy(), drawing]


def two_clocks() -> list[Record]:
    types, kind = jazzy().types, 'rosgraph_msgs/msg/Clock'
    message = types[kind](types['builtin_interfaces/msg/Time'](1, 0))
    data = bytes(jazzy().serialize_cdr(message, kind))
    return [
        *healthy(),
        Record('/clock', kind, BEGIN, data),
        Record('/sim/clock', kind, BEGIN, data),
    ]


ILL: dict[str, tuple[Callable[[], list[Record]], str, Level]] = {
    'no message': (list, 'messages', Level.FAIL),
    'a clock that was not set': (lambda: moved(-1.7e9), 'log times', Level.WARN),
    'a clock of the future': (lambda: moved(1e9), 'log times', Level.WARN),
    'simulated time in the headers': (lambda: moved(1e6), 'header offset', Level.WARN),
    'header stamps that go back': (backwards, 'header order', Level.FAIL),
    'header stamps of zero': (
        lambda: [picture('colour', BEGIN + k, 0) for k in range(5)],
        'header set',
        Level.FAIL,
    ),
    'a gap': (lambda: gap(10, 20), 'gaps', Level.FAIL),
    'one depth picture lost': (without(7, 'depth'), 'rgb-d pairs', Level.FAIL),
    'one colour picture lost': (without(7, 'colour'), 'rgb-d pairs', Level.FAIL),
    'the first depth picture lost': (without(0, 'depth'), 'rgb-d pairs', Level.WARN),
    'the last colour picture lost': (without(-1, 'colour'), 'rgb-d pairs', Level.WARN),
    'colour that ends early': (
        lambda: [
            r for r in healthy() if r.topic != NAMES['colour'] or r.stamp < BEGIN + 2 * PERIOD
        ] + [picture('depth', BEGIN + k * PERIOD, BEGIN + k * PERIOD) for k in range(30, 60)],
        'rgb-d pairs',
        Level.FAIL,
    ),
    'another picture than the camera\'s': (drawn_upon, 'camera info', Level.OK),
    'no depth': (
        lambda: [r for r in healthy() if r.topic != NAMES['depth']],
        'rgb-d pairs',
        Level.FAIL,
    ),
    'no camera info': (
        lambda: [r for r in healthy() if r.topic != NAMES['info']],
        'camera info',
        Level.FAIL,
    ),
    'camera info of another size': (
        lambda: [camera_info(r.stamp, (480, 640)) if r.type == CAMERA_INFO else r
                 for r in healthy()],
        'camera info',
        Level.FAIL,
    ),
    'pictures of two sizes': (two_sizes, 'pictures', Level.FAIL),
    "another driver's names": (foreign_name, 'camera topics', Level.WARN),
    'a message that is none': (undecodable, 'decoding', Level.FAIL),
    'a type nobody defines': (untyped, 'definitions', Level.WARN),
    'a message twice': (lambda: [*healthy(), healthy()[-1]], 'repeats', Level.WARN),
    'two clocks': (two_clocks, 'clock', Level.FAIL),
    'a relative name': (lambda: [*healthy(), text_record('a', BEGIN, 'x')], 'names', Level.WARN),
}  # fmt: skip


@pytest.mark.parametrize('illness', ILL)
def test_illnesses_are_found(tmp_path: Path, illness: str) -> None:
    make, check, level = ILL[illness]
    assert levels(write(tmp_path, make()))[check] == level


def test_qos(tmp_path: Path) -> None:
    belief = text_record('/goal_belief', BEGIN, 'x')
    (tmp_path / 'a').mkdir()
    (tmp_path / 'b').mkdir()
    assert levels(write(tmp_path / 'a', [belief], (BEST_EFFORT,)))['qos match'] == Level.FAIL
    assert levels(write(tmp_path / 'b', [belief], ()))['qos match'] == Level.WARN


def test_hashes_that_belong_to_another_definition(tmp_path: Path) -> None:
    with BagWriter(tmp_path / 'bag') as writer:
        writer.add(Topic('/a', STRING, 0, (), 'string data', 'ros2msg', 'RIHS01_' + 'ab' * 32))
        writer.write(text_record('/a', BEGIN, 'x'))
    assert levels(tmp_path / 'bag')['type hashes'] == Level.WARN


@pytest.mark.parametrize('kind', ['mcap zstd', 'ros1 bz2', 'sqlite3', 'ros1 none'])
def test_storage_without_checksums_is_told(sample: Callable[[str], Path], kind: str) -> None:
    expected = Level.OK if kind in ('mcap zstd', 'ros1 bz2') else Level.WARN
    assert levels(sample(kind))['checksums'] == expected


def test_damaged_files(tmp_path: Path) -> None:
    bag = write(tmp_path, healthy())
    file, metadata = next(bag.glob('*.mcap')), bag / 'metadata.yaml'
    data, text = file.read_bytes(), metadata.read_text()
    file.write_bytes(data[:-20])
    assert levels(bag)['index'] == Level.FAIL
    spoiled = bytearray(data)
    spoiled[data.index(b'\x04\0\0\0zstd') + 90] ^= 0xFF
    file.write_bytes(spoiled)
    found = examine(bag)
    assert Level.FAIL in (found['opens'].level, found['chunks'].level)
    file.write_bytes(data)
    metadata.write_text(text.replace('message_count: 90', 'message_count: 91'))
    assert levels(bag)['metadata'] == Level.FAIL
    metadata.unlink()
    assert levels(bag)['metadata'] == Level.WARN
    metadata.write_text(text.replace('history: keep_last', 'history: [1]'))
    file.rename(bag / 'other.mcap')
    assert levels(bag)['files'] == Level.FAIL
    (bag / 'other.mcap').write_bytes(b'nothing')
    assert levels(bag) == {'opens': Level.FAIL}
    assert CliRunner().invoke(app, ['doctor', str(bag)]).exit_code == 1


def foreign_camera(form: str, data: bytes) -> Record:
    types, kind = jazzy().types, 'sensor_msgs/msg/CompressedImage'
    header = types['std_msgs/msg/Header'](
        types['builtin_interfaces/msg/Time'](*divmod(BEGIN, 10**9)), 'c'
    )
    message = types[kind](header, form, np.frombuffer(data, np.uint8))
    return Record('/cam', kind, BEGIN, bytes(jazzy().serialize_cdr(message, kind)))


def test_images_that_cannot_be_decoded(tmp_path: Path) -> None:
    """A video codec is a warning, for the bag is whole; a damaged JPEG is a failure."""
    for name, form, data, level in (
        ('h264', 'h264', b'\0\0\0\1gB', Level.WARN),
        ('jpeg', 'jpeg', b'\xff\xd8\xff', Level.FAIL),
    ):
        (tmp_path / name).mkdir()
        path = write(tmp_path / name, [foreign_camera(form, data)])
        assert levels(path)['decoding'] == level
        done = CliRunner().invoke(app, ['doctor', str(path)])
        assert done.exit_code == (level == Level.FAIL)
        assert len(done.stdout.splitlines()) == len(levels(path))
        assert 'Not checked: /cam: expected' in done.stdout or level == Level.FAIL


def test_the_first_stamp_before_the_clock_is_no_gap(tmp_path: Path) -> None:
    first = picture('colour', 0, 0)._replace(topic='/cam')
    records = [picture('colour', BEGIN + k * PERIOD, BEGIN + k * PERIOD) for k in range(FRAMES)]
    results = levels(write(tmp_path, [first, *(r._replace(topic='/cam') for r in records)]))
    assert results['gaps'] == Level.OK
    assert results['log times'] == Level.WARN


def test_names_with_control_characters_stay_on_one_line(tmp_path: Path) -> None:
    path = write(tmp_path, [text_record('/a\n\x1b[31m/b', BEGIN, 'x')])
    done = CliRunner().invoke(app, ['doctor', str(path)])
    assert len(done.stdout.splitlines()) == len(levels(path))
    assert '\x1b' not in done.stdout


def test_a_picture_topic_alone_is_not_called_a_pair(tmp_path: Path) -> None:
    """A colour camera without depth names the half that is missing."""
    results = examine(write(tmp_path, [picture('colour', BEGIN, BEGIN)]))
    assert 'without its other half' in results['rgb-d pairs'].sentence
    assert results['camera topics'].level == Level.WARN
    assert IMAGE in results['camera topics'].sentence

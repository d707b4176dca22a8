"""A type that is defined in more than one way: each message is read by its own definition."""

from __future__ import annotations

import csv
import struct
from hashlib import md5
from pathlib import Path

import pytest
from rosbags.rosbag1 import Writer as Writer1
from typer.testing import CliRunner

from likeme_bags.bag_console import app
from likeme_bags.doctor import examine
from likeme_bags.editing import cut, merge, repair
from likeme_bags.errors import BagError
from likeme_bags.reading import open_bag
from likeme_bags.typestores import decode
from likeme_bags.values import Record, Topic
from likeme_bags.writing import BagWriter

POINT = 'my_msgs/msg/Point'
XY, YX = 'float64 x\nfloat64 y\n', 'float64 y\nfloat64 x\n'
XYZ = 'float64 x\nfloat64 y\nfloat64 z\n'
# x = 1, y = 2 (and z = 3) by each definition.
VALUES = {XY: (1.0, 2.0), YX: (2.0, 1.0), XYZ: (1.0, 2.0, 3.0)}


def point(definition: str, stamp: int, topic: str = '/p') -> tuple[Topic, Record]:
    values = VALUES[definition]
    data = b'\0\1\0\0' + struct.pack(f'<{len(values)}d', *values)
    return Topic(topic, POINT, 0, (), definition, 'ros2msg'), Record(topic, POINT, stamp, data)


def write(path: Path, *points: tuple[Topic, Record], storage: str = 'mcap') -> Path:
    with BagWriter(path, storage) as writer:
        for topic, record in points:
            writer.add(topic)
            writer.write(record)
    return path


def values(path: Path) -> list[tuple[float, float]]:
    """x and y of all messages."""
    with open_bag(path) as bag:
        topics = {topic.key: topic for topic in bag.topics}
        decoded = [decode(topics[r.key], r.data) for r in bag.records()]
        assert bag.complete
    return [(m.x, m.y) for m in decoded]  # type: ignore[attr-defined]


def split(tmp_path: Path, *definitions: str, storage: str = 'mcap') -> Path:
    """A bag of one file a definition."""
    (tmp_path / 'split').mkdir()
    for k, definition in enumerate(definitions):
        part = write(tmp_path / f'part{k}', point(definition, k + 1), storage=storage)
        file = next(p for p in part.iterdir() if p.suffix != '.yaml')
        file.rename(tmp_path / 'split' / f'split_{k}{file.suffix}')
    return tmp_path / 'split'


@pytest.mark.parametrize('second', [YX, XYZ])
@pytest.mark.parametrize('storage', ['mcap', 'sqlite3'])
def test_split_files_with_two_definitions(tmp_path: Path, second: str, storage: str) -> None:
    source = split(tmp_path, XY, second, XY, storage=storage)
    assert values(source) == [(1, 2)] * 3
    cut(source, tmp_path / 'cut')
    repair(source, tmp_path / 'repaired')
    for path in (tmp_path / 'cut', tmp_path / 'repaired'):
        assert values(path) == [(1, 2)] * 3
        with open_bag(path) as bag:
            assert [topic.count for topic in bag.topics] == [2, 1]
    done = CliRunner().invoke(
        app, ['export', str(source), '--format', 'csv', '--out', str(tmp_path / 'csv')]
    )
    assert done.exit_code == 0, done.stderr
    tables = sorted((tmp_path / 'csv').iterdir())
    names = ['p.csv'] if second == YX else ['p-2.csv', 'p.csv']
    assert [path.name for path in tables] == names
    rows = [row for path in tables for row in csv.DictReader(path.open())]
    assert [(row['x'], row['y']) for row in rows] == [('1.0', '2.0')] * 3


def test_the_doctor_tells_of_two_definitions(tmp_path: Path) -> None:
    found = examine(split(tmp_path, XY, YX))
    assert 'defined in more than one way' in found['topics'].sentence


@pytest.mark.parametrize('topics', [('/p', '/p'), ('/p', '/q')])
def test_bags_merged_with_two_definitions(tmp_path: Path, topics: tuple[str, str]) -> None:
    first = write(tmp_path / 'a', point(XY, 1, topics[0]), point(XY, 3, topics[0]))
    second = write(tmp_path / 'b', point(YX, 2, topics[1]))
    merge([first, second], tmp_path / 'ab')
    merge([second, first], tmp_path / 'ba')
    # Merged once more, nothing is told apart that is the same.
    merge([tmp_path / 'ab', tmp_path / 'ba'], tmp_path / 'all')
    for name, count in (('ab', 3), ('ba', 3), ('all', 6)):
        assert values(tmp_path / name) == [(1, 2)] * count
        with open_bag(tmp_path / name) as bag:
            assert len(bag.topics) == 2


def test_comments_do_not_make_another_definition(tmp_path: Path) -> None:
    topic, record = point(XY, 1)
    first = write(tmp_path / 'a', (topic, record))
    other = Topic('/p', POINT, 0, (), f'# In metres.\n{XY}', 'ros2msg')
    merge([first, write(tmp_path / 'b', (other, record))], tmp_path / 'ab')
    with open_bag(tmp_path / 'ab') as bag:
        assert len(bag.topics) == 1
        assert bag.warnings == ()


@pytest.mark.parametrize('topics', [('/p', '/p'), ('/p', '/q')])
def test_sqlite3_cannot_hold_two_definitions(tmp_path: Path, topics: tuple[str, str]) -> None:
    bags = [
        write(tmp_path / f'{k}', point(definition, k, topics[k]))
        for k, definition in enumerate((XY, YX))
    ]
    with pytest.raises(BagError, match=f'Expected one definition of {POINT}, got two'):
        merge(bags, tmp_path / 'out', 'sqlite3')
    assert not (tmp_path / 'out').exists()


@pytest.mark.parametrize('topics', [('/p', '/p'), ('/p', '/q')])
def test_ros1_connections_with_two_definitions(tmp_path: Path, topics: tuple[str, str]) -> None:
    with Writer1(tmp_path / 'a.bag') as writer:
        for k, definition in enumerate((XY, YX)):
            connection = writer.add_connection(
                topics[k], POINT, msgdef=definition, md5sum=md5(definition.encode()).hexdigest()
            )
            writer.write(connection, k + 1, struct.pack('<2d', *VALUES[definition]))
    assert values(tmp_path / 'a.bag') == [(1, 2)] * 2
    cut(tmp_path / 'a.bag', tmp_path / 'cut')
    assert values(tmp_path / 'cut') == [(1, 2)] * 2

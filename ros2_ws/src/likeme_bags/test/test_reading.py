"""Whole bags of every kind come back as they were written."""

from __future__ import annotations

import shutil
import sqlite3
from collections.abc import Callable
from copy import deepcopy
from pathlib import Path

import pytest
import yaml
from backports import zstd
from rosbags.interfaces import Qos, QosDurability, QosHistory, QosLiveliness, QosReliability
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore
from sample_bags import BEGIN, CHATTER, COLOUR, KINDS, STRING, TOPICS, text_record

from likeme_bags.errors import BagError
from likeme_bags.qos import FOREVER, LATCHED
from likeme_bags.reading import open_bag
from likeme_bags.typestores import jazzy
from likeme_bags.values import Record, Topic
from likeme_bags.writing import BagWriter

Sample = Callable[[str], Path]


@pytest.mark.parametrize('kind', KINDS)
@pytest.mark.parametrize('thorough', [False, True], ids=['by index', 'thorough'])
def test_all_messages_of_every_kind(
    sample: Sample, written: list[Record], kind: str, thorough: bool
) -> None:
    with open_bag(sample(kind), thorough) as bag:
        assert list(bag.records()) == written
        assert bag.count == len(written)
        assert (bag.start, bag.end) == (written[0].stamp, written[-1].stamp)
        assert {(t.name, t.type, t.count) for t in bag.topics} == {
            (t.name, t.type, 20) for t in TOPICS
        }
        assert (bag.warnings, bag.complete) == ((), True)


@pytest.mark.parametrize('kind', KINDS)
def test_a_part_by_time_and_topic(sample: Sample, written: list[Record], kind: str) -> None:
    begin, end = written[10].stamp, written[40].stamp
    with open_bag(sample(kind)) as bag:
        wanted = [r for r in written if r.topic == COLOUR and begin <= r.stamp < end]
        assert list(bag.records([COLOUR], begin, end)) == wanted
        assert list(bag.records(['/nothing'])) == []
        assert list(bag.records(start=bag.end + 1)) == []


def test_two_readers_of_one_bag_do_not_disturb_each_other(
    mcap: Path, written: list[Record]
) -> None:
    with open_bag(mcap) as bag:
        pairs = list(zip(bag.records(), bag.records(), strict=True))
    assert [a for a, _ in pairs] == [b for _, b in pairs] == written


@pytest.mark.parametrize('kind', ['mcap zstd', 'sqlite3'])
def test_without_metadata_the_files_are_read(
    sample: Sample, written: list[Record], kind: str
) -> None:
    folder = sample(kind)
    (folder / 'metadata.yaml').unlink()
    with open_bag(folder) as bag:
        assert list(bag.records()) == written
        assert bag.complete
        assert bag.warnings == ('metadata.yaml is missing; the files beside it were read.',)


def test_a_loose_storage_file(sample: Sample, written: list[Record]) -> None:
    for kind in ('mcap plain', 'sqlite3'):
        folder = sample(kind)
        file = next(p for p in folder.iterdir() if p.name != 'metadata.yaml')
        with open_bag(file) as bag:
            assert list(bag.records()) == written
        shutil.rmtree(folder)


@pytest.mark.parametrize('storage', [StoragePlugin.MCAP, StoragePlugin.SQLITE3])
@pytest.mark.parametrize('mode', [CompressionMode.FILE, CompressionMode.MESSAGE])
def test_compressed_files_and_messages(
    tmp_path: Path, written: list[Record], storage: StoragePlugin, mode: CompressionMode
) -> None:
    writer = Writer(tmp_path / 'bag', version=8, storage_plugin=storage)
    writer.set_compression(mode, CompressionFormat.ZSTD)
    with writer:
        connections = {
            t.name: writer.add_connection(t.name, t.type, typestore=jazzy()) for t in TOPICS
        }
        for record in written:
            writer.write(connections[record.topic], record.stamp, record.data)
    with open_bag(tmp_path / 'bag') as bag:
        assert list(bag.records()) == written
        assert bag.complete


def split(tmp_path: Path, written: list[Record]) -> Path:
    """A bag of three files, whose times overlap."""
    parts = [written[0::3], written[1::3], written[2::3]]
    folder = tmp_path / 'split'
    folder.mkdir()
    for k, part in enumerate(parts):
        with BagWriter(tmp_path / f'part{k}') as writer:
            for topic in TOPICS:
                writer.add(topic)
            for record in part:
                writer.write(record)
        (tmp_path / f'part{k}' / f'part{k}.mcap').rename(folder / f'split_{k}.mcap')
    document = yaml.safe_load((tmp_path / 'part0' / 'metadata.yaml').read_text())
    info = document['rosbag2_bagfile_information']
    info['relative_file_paths'] = [f'split_{k}.mcap' for k in range(3)]
    info['message_count'] = len(written)
    for topic, part in zip(info['topics_with_message_count'], parts, strict=True):
        topic['message_count'] = len(part)
    (folder / 'metadata.yaml').write_text(yaml.safe_dump(document))
    return folder


def test_split_files_are_one_stream(tmp_path: Path, written: list[Record]) -> None:
    with open_bag(split(tmp_path, written)) as bag:
        assert list(bag.records()) == written
        assert [t.count for t in bag.topics] == [20, 20, 20]


def test_a_missing_part_of_a_split_bag_is_a_loss(tmp_path: Path, written: list[Record]) -> None:
    folder = split(tmp_path, written)
    (folder / 'split_1.mcap').unlink()
    for gone in (False, True):
        if gone:
            (folder / 'metadata.yaml').unlink()
        with open_bag(folder) as bag:
            assert len(list(bag.records())) == 40
            assert not bag.complete


def test_metadata_that_promises_more_is_a_loss(mcap: Path, written: list[Record]) -> None:
    text = (mcap / 'metadata.yaml').read_text()
    (mcap / 'metadata.yaml').write_text(text.replace('message_count: 60', 'message_count: 61'))
    with open_bag(mcap) as bag:
        assert list(bag.records()) == written
        assert not bag.complete
        assert '60 messages found, metadata.yaml says 61.' in bag.warnings


def test_qos_that_differs_costs_no_message(mcap: Path, written: list[Record]) -> None:
    """The rosbags library passes on nothing of such a bag."""
    document = yaml.safe_load((mcap / 'metadata.yaml').read_text())
    reliable = Qos(
        QosHistory.KEEP_LAST,
        7,
        QosReliability.RELIABLE,
        QosDurability.VOLATILE,
        FOREVER,
        FOREVER,
        QosLiveliness.AUTOMATIC,
        FOREVER,
        False,
    )
    profile = {
        'history': 'keep_last',
        'depth': 7,
        'reliability': 'reliable',
        'durability': 'volatile',
        'deadline': FOREVER._asdict(),
        'lifespan': FOREVER._asdict(),
        'liveliness': 'automatic',
        'liveliness_lease_duration': FOREVER._asdict(),
        'avoid_ros_namespace_conventions': False,
    }
    for topic in document['rosbag2_bagfile_information']['topics_with_message_count']:
        topic['topic_metadata']['offered_qos_profiles'] = [deepcopy(profile)]
    (mcap / 'metadata.yaml').write_text(yaml.safe_dump(document))
    with open_bag(mcap) as bag:
        assert list(bag.records()) == written
        assert bag.complete
        assert {t.qos for t in bag.topics} == {(reliable,)}


def test_messages_serialised_otherwise_are_refused(mcap: Path) -> None:
    text = (mcap / 'metadata.yaml').read_text()
    one = text.replace('serialization_format: cdr', 'serialization_format: protobuf', 1)
    (mcap / 'metadata.yaml').write_text(one)
    with open_bag(mcap) as bag:
        assert len(list(bag.records())) == 40
        assert not bag.complete
        assert "metadata.yaml says 'protobuf'" in ' '.join(bag.warnings)
    (mcap / 'metadata.yaml').write_text(text.replace('format: cdr', 'format: protobuf'))
    with pytest.raises(BagError, match=r"Expected .* cdr, metadata\.yaml says 'protobuf'"):
        open_bag(mcap)


def test_old_type_names_and_strange_ones(sample: Sample, tmp_path: Path) -> None:
    folder = sample('sqlite3')
    with sqlite3.connect(next(folder.glob('*.db3'))) as db:
        db.execute('UPDATE topics SET type = ? WHERE name = ?', ('std_msgs/String', CHATTER))
        db.execute('UPDATE topics SET type = ? WHERE name = ?', ('no type', COLOUR))
    db.close()
    with open_bag(next(folder.glob('*.db3'))) as bag:
        records = list(bag.records())
        assert {r.type for r in records if r.topic == CHATTER} == {STRING}
        assert COLOUR not in {r.topic for r in records}
        assert not bag.complete
        assert any('no type' in w for w in bag.warnings)


def test_types_that_nobody_knows_are_passed_on_raw(tmp_path: Path) -> None:
    record = Record('/mine', 'my_msgs/msg/Own', 5, b'\0\1\0\0\1\2\3\4')
    for storage in ('mcap', 'sqlite3'):
        with BagWriter(tmp_path / storage, storage) as writer:
            writer.add(Topic(record.topic, record.type))
            writer.write(record)
        with open_bag(tmp_path / storage) as bag:
            assert list(bag.records()) == [record]
            assert bag.topics[0].definition == bag.topics[0].type_hash == ''


@pytest.mark.parametrize('storage', ['mcap', 'sqlite3'])
def test_an_empty_bag_has_no_duration(tmp_path: Path, storage: str) -> None:
    with BagWriter(tmp_path / 'bag', storage) as writer:
        writer.add(TOPICS[0])
    with open_bag(tmp_path / 'bag') as bag:
        assert (bag.count, bag.start, bag.end) == (0, 0, 0)
        assert list(bag.records()) == []
        assert bag.complete


def test_one_topic_with_two_types(tmp_path: Path, written: list[Record]) -> None:
    """Two publishers disagreed: every record carries its own type."""
    picture = written[1]._replace(topic=CHATTER)
    with BagWriter(tmp_path / 'bag') as writer:
        writer.add(Topic(CHATTER, STRING))
        writer.add(Topic(CHATTER, picture.type))
        writer.write(written[0])
        writer.write(picture)
    with open_bag(tmp_path / 'bag') as bag:
        assert [r.type for r in bag.records()] == [STRING, picture.type]


def test_a_journal_left_by_a_killed_recorder_is_played_into_a_copy(tmp_path: Path) -> None:
    with BagWriter(tmp_path / 'bag', 'sqlite3') as writer:
        writer.add(TOPICS[0])
        writer.write(text_record(CHATTER, BEGIN, 'first'))
    file = next((tmp_path / 'bag').glob('*.db3'))
    db = sqlite3.connect(file)
    db.execute('PRAGMA journal_mode = WAL')
    data = text_record(CHATTER, BEGIN + 1, 'second').data
    db.execute(
        'INSERT INTO messages (topic_id, timestamp, data) VALUES (1, ?, ?)', (BEGIN + 1, data)
    )
    db.commit()
    (tmp_path / 'left').mkdir()
    for each in file.parent.glob('*.db3*'):
        shutil.copy(each, tmp_path / 'left' / each.name)
    db.close()
    before = {p.name: p.read_bytes() for p in (tmp_path / 'left').iterdir()}
    with open_bag(tmp_path / 'left') as bag:
        assert [r.stamp - BEGIN for r in bag.records()] == [0, 1]
    assert {p.name: p.read_bytes() for p in (tmp_path / 'left').iterdir()} == before


def test_ros1_latched_topics_are_transient_local(tmp_path: Path) -> None:
    store = get_typestore(Stores.ROS1_NOETIC)
    with Writer1(tmp_path / 'a.bag') as writer:
        connection = writer.add_connection('/a', STRING, typestore=store, latching=1)
        writer.write(connection, 1, bytes(store.serialize_ros1(store.types[STRING]('hi'), STRING)))
    with open_bag(tmp_path / 'a.bag') as bag:
        assert bag.topics[0].qos == (LATCHED,)


def test_ros1_types_that_ros2_lays_out_differently(tmp_path: Path) -> None:
    """Range gained a variance between ROS 1 and 2; other fields keep their values."""
    old, kind = get_typestore(Stores.ROS1_NOETIC), 'sensor_msgs/msg/Range'
    header = old.types['std_msgs/msg/Header'](
        7, old.types['builtin_interfaces/msg/Time'](3, 4), 'sonar'
    )
    message = old.types[kind](header, 1, 0.5, 0.25, 4.0, 2.0)
    with Writer1(tmp_path / 'a.bag') as writer:
        connection = writer.add_connection('/a', kind, typestore=old)
        writer.write(connection, 1, bytes(old.serialize_ros1(message, kind)))
    with open_bag(tmp_path / 'a.bag') as bag:
        record = next(bag.records())
        assert 'carried over by name' in bag.warnings[0]
        assert bag.complete
    new = jazzy().deserialize_cdr(record.data, kind)
    assert (new.header.stamp.sec, new.header.frame_id) == (3, 'sonar')
    assert (new.radiation_type, new.min_range, new.max_range, new.range) == (1, 0.25, 4.0, 2.0)
    assert new.variance == 0


def test_what_is_no_bag_is_refused_in_one_sentence(tmp_path: Path) -> None:
    (tmp_path / 'text.mcap').write_text('hello')
    (tmp_path / 'text.db3').write_text('hello')
    (tmp_path / 'text.bag').write_text('hello')
    (tmp_path / 'none.mcap').touch()
    (tmp_path / 'notes.txt').touch()
    (tmp_path / 'nothing').mkdir()
    (tmp_path / 'bad.mcap.zstd').write_bytes(zstd.compress(b'no bag'))
    for name in ('text.mcap', 'text.db3', 'text.bag', 'none.mcap', 'notes.txt', 'nothing', 'gone',
                 'bad.mcap.zstd'):  # fmt: skip
        with pytest.raises(BagError) as raised:
            open_bag(tmp_path / name)
        assert str(raised.value).count('\n') == 0
        assert name.removesuffix('.zstd') in str(raised.value)

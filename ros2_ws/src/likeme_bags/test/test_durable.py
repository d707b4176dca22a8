"""A writer whose bag is whole after every flush."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from rosbags.interfaces import Connection
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore

from likeme_bags.durable import DurableMcap, DurableWriter
from likeme_bags.errors import BagError
from likeme_bags.reading import open_bag

TEXT = 'std_msgs/msg/String'
STORE = get_typestore(Stores.ROS2_JAZZY)
STORAGES = pytest.mark.parametrize(
    ('storage', 'compression'), [('mcap', 'zstd'), ('mcap', 'lz4'), ('sqlite3', 'zstd')]
)


def data(number: int) -> bytes:
    return bytes(STORE.serialize_cdr(STORE.types[TEXT](f'message {number}'), TEXT))


def begun(path: Path, storage: str, compression: str = 'zstd') -> tuple[DurableWriter, Connection]:
    writer = DurableWriter(path, storage, compression, custom={'why': 'a test'})
    writer.open()
    return writer, writer.add_connection('talk', TEXT, typestore=STORE)


def texts(path: Path) -> list[bytes]:
    """What our reader and the library read, which must be the same."""
    with open_bag(path) as bag:
        ours = [record.data for record in bag.records()]
        assert bag.complete, bag.warnings
    if ours:
        with Reader(path) as reader:
            assert [bytes(raw) for _, _, raw in reader.messages()] == ours
    return ours


@STORAGES
def test_after_every_flush_a_copy_is_a_whole_bag(
    tmp_path: Path, storage: str, compression: str
) -> None:
    writer, connection = begun(tmp_path / 'bag', storage, compression)
    assert texts(tmp_path / 'bag') == []
    for number in range(9):
        writer.write(connection, 1000 + number, data(number))
        if number % 3 == 2:
            writer.flush()
            copy = tmp_path / f'copy_{number}' / 'bag'
            shutil.copytree(tmp_path / 'bag', copy)
            assert texts(copy) == [data(k) for k in range(number + 1)]
    writer.close()
    assert texts(tmp_path / 'bag') == [data(k) for k in range(9)]
    with open_bag(tmp_path / 'bag') as bag:
        assert (bag.start, bag.end, dict(bag.custom)) == (1000, 1008, {'why': 'a test'})
        assert bag.topics[0].type_hash.startswith('RIHS01_')
        assert bag.topics[0].definition


@STORAGES
def test_what_was_not_flushed_costs_nothing_else(
    tmp_path: Path, storage: str, compression: str
) -> None:
    writer, connection = begun(tmp_path / 'bag', storage, compression)
    writer.write(connection, 1, data(1))
    writer.flush()
    writer.write(connection, 2, data(2))
    shutil.copytree(tmp_path / 'bag', tmp_path / 'copy' / 'bag')
    assert texts(tmp_path / 'copy' / 'bag') == [data(1)]
    writer.close()


def test_chunks_grow_to_the_size_that_is_wanted(tmp_path: Path) -> None:
    writer, connection = begun(tmp_path / 'bag', 'mcap')
    assert isinstance(writer.storage, DurableMcap)
    writer.storage.chunk_size = 20 * 2**20
    for number in range(5):
        writer.write(connection, number, bytes(3 * 2**20))
    assert writer.storage.chunks == []
    writer.close()
    assert (tmp_path / 'bag' / 'bag.mcap').stat().st_size < 2**16
    with open_bag(tmp_path / 'bag') as bag:
        assert [len(record.data) for record in bag.records()] == [3 * 2**20] * 5


def test_a_bag_that_is_there_and_a_format_that_is_none_are_refused(tmp_path: Path) -> None:
    with pytest.raises(BagError, match='exists already'):
        DurableWriter(tmp_path)
    with pytest.raises(BagError, match="mcap or sqlite3, got 'rosbag'"):
        DurableWriter(tmp_path / 'bag', 'rosbag')
    with pytest.raises(BagError, match="sqlite3 bag packed by zstd or none, got 'lz4'"):
        DurableWriter(tmp_path / 'bag', 'sqlite3', 'lz4')

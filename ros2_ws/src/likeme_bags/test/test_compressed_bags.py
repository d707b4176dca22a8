"""Bags compressed by rosbag2 or by hand, without the metadata.yaml that would say so."""

from __future__ import annotations

import bz2
import sqlite3
from collections.abc import Callable
from pathlib import Path

import lz4.frame
import pytest
from backports import zstd
from rosbags.rosbag2 import Reader
from sample_bags import BEGIN, CHATTER, KINDS, STRING, text_record

from likeme_bags.editing import needs_repair, repair
from likeme_bags.errors import BagError
from likeme_bags.reading import open_bag
from likeme_bags.values import Record, Topic
from likeme_bags.writing import BagWriter

COMPRESS: dict[str, Callable[[bytes], bytes]] = {
    'zstd': zstd.compress,
    'zst': zstd.compress,
    'lz4': lz4.frame.compress,
    'bz2': bz2.compress,
}
RECORDS = [text_record(CHATTER, BEGIN + k, f'message {k}') for k in range(20)]


def message_by_message(folder: Path, storage: str, method: str) -> Path:
    """A storage file whose messages are compressed one by one; there is no metadata.yaml."""
    with BagWriter(folder, storage, compress=False) as writer:
        writer.add(Topic(CHATTER, STRING))
        for record in RECORDS:
            writer.write(record._replace(data=COMPRESS[method](record.data)))
    (folder / 'metadata.yaml').unlink()
    return next(folder.iterdir())


@pytest.mark.parametrize('storage', ['mcap', 'sqlite3'])
@pytest.mark.parametrize('method', ['zstd', 'lz4'])
@pytest.mark.parametrize('loose', [False, True])
def test_messages_compressed_one_by_one(
    tmp_path: Path, storage: str, method: str, loose: bool
) -> None:
    file = message_by_message(tmp_path / 'bag', storage, method)
    path = file if loose else file.parent
    with open_bag(path) as bag:
        assert list(bag.records()) == RECORDS
        assert bag.complete
        assert any('compressed one by one' in warning for warning in bag.warnings)
    assert needs_repair(path)
    assert repair(path, tmp_path / 'out').messages == 20
    with Reader(tmp_path / 'out') as reader:
        assert [data for _, _, data in reader.messages()] == [r.data for r in RECORDS]


def test_messages_that_are_damaged_or_of_no_known_compression_are_lost(tmp_path: Path) -> None:
    file = message_by_message(tmp_path / 'bag', 'sqlite3', 'zstd')
    with sqlite3.connect(file) as db:
        db.execute("UPDATE messages SET data = x'28b52ffd00' WHERE id = 1")
        db.execute("UPDATE messages SET data = x'0102030405' WHERE id = 2")
    db.close()
    with open_bag(file) as bag:
        assert list(bag.records()) == RECORDS[2:]
        assert not bag.complete


@pytest.mark.parametrize('ending', COMPRESS)
@pytest.mark.parametrize('kind', ['mcap lz4', 'sqlite3', 'ros1 none'])
def test_files_compressed_as_a_whole(
    tmp_path: Path, written: list[Record], kind: str, ending: str
) -> None:
    path = KINDS[kind][0](tmp_path, written)
    file = path if path.is_file() else next(p for p in path.iterdir() if p.suffix != '.yaml')
    raw = file.read_bytes()
    data = COMPRESS[ending](raw)
    # Two compressed streams, one after the other, as cat and parallel compressors make them.
    streams = COMPRESS[ending](raw[:1000]) + COMPRESS[ending](raw[1000:])
    for name in (f'{file.name}.{ending}', file.name):
        path = tmp_path / 'compressed' / name
        path.parent.mkdir(exist_ok=True)
        for content in (data, streams):
            path.write_bytes(content)
            with open_bag(path) as bag:
                assert list(bag.records()) == written
                assert bag.complete
        path.write_bytes(streams[: len(streams) * 2 // 3])
        try:
            with open_bag(path) as bag:
                assert len(list(bag.records())) < len(written)
                complete = bag.complete
        except BagError:
            # What came before the cut is too little to be a bag.
            complete = False
        assert not complete
        path.unlink()

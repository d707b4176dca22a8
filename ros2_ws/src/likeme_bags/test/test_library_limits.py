"""What the rosbags library refuses, holds in memory or stops at is read all the same."""

from __future__ import annotations

import sqlite3
import struct
from collections.abc import Callable
from pathlib import Path

import pytest
from sample_bags import BEGIN, CHATTER, KINDS, STRING, TOPICS, sample_records, text_record

from likeme_bags.mcap_format import MAGIC, PREFIX, McapOp
from likeme_bags.reading import open_bag
from likeme_bags.values import Record, Topic
from likeme_bags.writing import BagWriter

Sample = Callable[[str], Path]


def storage_file(folder: Path) -> Path:
    return next(p for p in folder.iterdir() if p.suffix != '.yaml')


def test_chunks_that_overlap_are_sorted_on_disk(
    tmp_path: Path, written: list[Record], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Every chunk spans the whole time, so that the library would hold all of them."""
    with BagWriter(tmp_path / 'bag') as writer:
        for topic in TOPICS:
            writer.add(topic)
        for k in range(6):
            for record in written[k::6]:
                writer.write(record)
            writer.flush()
    for most in (2**28, 10_000):
        monkeypatch.setattr('likeme_bags.mcap_reader.MAX_OPEN', most)
        with open_bag(tmp_path / 'bag') as bag:
            assert list(bag.records()) == written
            assert list(bag.records(start=written[30].stamp)) == written[30:]
            assert bag.complete


def unchunked(written: list[Record]) -> bytes:
    """An MCAP file without chunks and index, as rosbag2's preset `fastwrite` nearly writes it."""

    def text(value: str) -> bytes:
        return struct.pack('<I', len(value)) + value.encode()

    def record(op: int, body: bytes) -> bytes:
        return PREFIX.pack(op, len(body)) + body

    parts = [MAGIC, record(McapOp.HEADER, text('') + text(''))]
    for key, topic in enumerate(TOPICS, 1):
        # A language that the library does not know, and QoS that does not parse.
        parts.append(
            record(McapOp.SCHEMA, struct.pack('<H', key) + text(topic.type) + text('x') * 2)
        )
        pairs = text('offered_qos_profiles') + text('- [')
        channel = struct.pack('<HH', key, key) + text(topic.name) + text('cdr')
        parts.append(record(McapOp.CHANNEL, channel + struct.pack('<I', len(pairs)) + pairs))
    keys = {topic.name: key for key, topic in enumerate(TOPICS, 1)}
    for each in written:
        head = struct.pack('<HIQQ', keys[each.topic], 0, each.stamp, each.stamp)
        parts.append(record(McapOp.MESSAGE, head + each.data))
    parts += [record(McapOp.DATA_END, bytes(4)), record(McapOp.FOOTER, bytes(20)), MAGIC]
    return b''.join(parts)


def test_a_file_without_chunks_out_of_order(tmp_path: Path, written: list[Record]) -> None:
    data = unchunked(written[::-1])
    (tmp_path / 'a.mcap').write_bytes(data)
    with open_bag(tmp_path / 'a.mcap') as bag:
        assert list(bag.records()) == written
        assert bag.complete
        assert bag.stamps(CHATTER).tolist() == [r.stamp for r in written if r.topic == CHATTER]
    (tmp_path / 'a.mcap').write_bytes(data[: len(data) // 2])
    with open_bag(tmp_path / 'a.mcap') as bag:
        passed = list(bag.records())
        assert passed == written[-len(passed) :]
        assert not bag.complete


def test_sqlite3_with_a_definition_in_another_language(
    sample: Sample, written: list[Record]
) -> None:
    file = storage_file(sample('sqlite3'))
    with sqlite3.connect(file) as db:
        db.execute("UPDATE message_definitions SET encoding = 'unknown'")
        db.execute("UPDATE topics SET offered_qos_profiles = '- ['")
    db.close()
    with open_bag(file) as bag:
        assert list(bag.records()) == written
        assert bag.complete


def test_sqlite3_with_a_name_that_no_uri_has(sample: Sample, written: list[Record]) -> None:
    file = storage_file(sample('sqlite3'))
    file = file.rename(file.with_name('100 % #1?.db3'))
    with open_bag(file) as bag:
        assert list(bag.records()) == written


def damaged_page(path: Path) -> Path:
    """A bag of 2000 rows with a page in the middle that is none, which the index does not show."""
    with BagWriter(path, 'sqlite3') as writer:
        writer.add(Topic(CHATTER, STRING))
        for k in range(2000):
            writer.write(text_record(CHATTER, BEGIN + k, f'{k}' * 20))
    file = storage_file(path)
    data = bytearray(file.read_bytes())
    at = data.index(b'1000' * 20) // 4096 * 4096
    data[at : at + 8] = b'\xff' * 8
    file.write_bytes(data)
    return file


@pytest.mark.parametrize('checked', [2**26, 0], ids=['when opened', 'when read'])
def test_a_damaged_page_costs_its_own_rows_only(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, checked: int
) -> None:
    monkeypatch.setattr('likeme_bags.sqlite_reader._CHECKED_SIZE', checked)
    file = damaged_page(tmp_path / 'bag')
    with open_bag(file) as bag:
        stamps = [record.stamp - BEGIN for record in bag.records()]
        assert stamps == sorted(set(stamps))
        assert 1900 < len(stamps) < 2000
        assert (stamps[0], stamps[-1]) == (0, 1999)
        assert not bag.complete


@pytest.mark.parametrize('kind', ['mcap zstd', 'ros1 bz2'])
def test_reading_goes_on_behind_a_damaged_chunk(tmp_path: Path, kind: str) -> None:
    """What is before and behind it comes once."""
    records = sample_records(11, frames=80)
    path = KINDS[kind][0](tmp_path, records)
    file = path if path.is_file() else storage_file(path)
    data = bytearray(file.read_bytes())
    at = len(data) // 2
    data[at : at + 100] = b'\xff' * 100
    file.write_bytes(data)
    with open_bag(file) as bag:
        passed = list(bag.records())
        assert not bag.complete
    first = next(k for k, record in enumerate(records) if record not in passed)
    lost = len(records) - len(passed)
    assert 0 < lost < 150
    assert passed == records[:first] + records[first + lost :]

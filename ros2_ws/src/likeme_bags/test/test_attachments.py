"""Attachments and metadata records of MCAP files are told of, and kept."""

from __future__ import annotations

import struct
from pathlib import Path
from zlib import crc32

import pytest
from sample_bags import KINDS
from typer.testing import CliRunner, Result

from likeme_bags.bag_console import app
from likeme_bags.mcap_format import MAGIC, PREFIX, McapOp
from likeme_bags.reading import open_bag
from likeme_bags.values import Record


def text(value: str) -> bytes:
    return struct.pack('<I', len(value)) + value.encode()


def attachment(name: str, data: bytes) -> bytes:
    body = struct.pack('<QQ', 1, 1) + text(name) + text('text/yaml')
    body += struct.pack('<Q', len(data)) + data
    body += struct.pack('<I', crc32(body))
    return PREFIX.pack(McapOp.ATTACHMENT, len(body)) + body


def metadata(name: str, key: str, value: str) -> bytes:
    pairs = text(key) + text(value)
    body = text(name) + struct.pack('<I', len(pairs)) + pairs
    return PREFIX.pack(McapOp.METADATA, len(body)) + body


def with_records(path: Path, *records: bytes) -> Path:
    """The file with these records behind its header, and without the index at its end."""
    data = path.read_bytes()
    begin = len(MAGIC) + PREFIX.size + PREFIX.unpack_from(data, len(MAGIC))[1]
    footer = PREFIX.pack(McapOp.FOOTER, 20) + bytes(20) + MAGIC
    path.write_bytes(data[:begin] + b''.join(records) + data[begin:-37] + footer)
    return path


def bag(*words: object) -> Result:
    done = CliRunner().invoke(app, [str(word) for word in words])
    assert done.exit_code == 0, done.stderr
    return done


def two_parts(tmp_path: Path, written: list[Record]) -> list[Path]:
    """An MCAP file with an attachment and one with a metadata record."""
    (tmp_path / 'split').mkdir()
    extra = (attachment('calib.yaml', b'fx: 525'), metadata('operator', 'site', 'lab 3'))
    files = []
    for k, record in enumerate(extra):
        (tmp_path / f'{k}').mkdir()
        folder = KINDS['mcap zstd'][0](tmp_path / f'{k}', written[k::2])
        file = with_records(next(folder.glob('*.mcap')), record)
        files.append(file.rename(tmp_path / 'split' / f'split_{k}.mcap'))
    return files


def kept(path: Path) -> list[tuple[str, str]]:
    with open_bag(path) as opened:
        assert len(list(opened.records())) == opened.count
        assert opened.complete
        return [(each.kind, each.name) for each in opened.attachments]


EXPECTED = [('attachment', 'calib.yaml'), ('metadata record', 'operator')]


@pytest.mark.parametrize('command', ['cut', 'repair'])
def test_of_split_files(tmp_path: Path, written: list[Record], command: str) -> None:
    source = two_parts(tmp_path, written)[0].parent
    said = bag('info', source).stdout
    assert "attachment 'calib.yaml'" in said
    assert "metadata record 'operator'" in said
    bag(command, source, '--out', tmp_path / 'out')
    assert kept(tmp_path / 'out') == EXPECTED
    assert attachment('calib.yaml', b'fx: 525') in (tmp_path / 'out' / 'out.mcap').read_bytes()
    # rosbag2's own copy of metadata.yaml is not taken over from the source.
    assert (tmp_path / 'out' / 'out.mcap').read_bytes().count(b'serialized_metadata') == 1


def test_of_merged_bags(tmp_path: Path, written: list[Record]) -> None:
    bag('merge', *two_parts(tmp_path, written), '--out', tmp_path / 'out')
    assert kept(tmp_path / 'out') == EXPECTED


def test_what_sqlite3_cannot_hold_is_told(tmp_path: Path, written: list[Record]) -> None:
    words = ('--storage', 'sqlite3', '--out', tmp_path / 'out')
    said = bag('merge', *two_parts(tmp_path, written), *words).stderr
    assert "Left out, as sqlite3 has no such thing: attachment 'calib.yaml'" in said
    assert "Left out, as sqlite3 has no such thing: metadata record 'operator'" in said

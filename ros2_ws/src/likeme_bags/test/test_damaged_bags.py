"""Damaged, cut and malicious bags: never a crash, never much memory, never a silent loss."""

from __future__ import annotations

import resource
import struct
import subprocess
import sys
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from zlib import crc32

import pytest
from backports import zstd
from sample_bags import KINDS, sample_records

from likeme_bags.errors import BagError
from likeme_bags.mcap_format import MAGIC, McapOp
from likeme_bags.reading import Bag, open_bag
from likeme_bags.values import Record

Sample = Callable[[str], Path]
FUZZ = Path(__file__).with_name('fuzz_bags.py')
# What a process that reads a 100 kB bomb may take in all, bytes.
MEMORY = 1536 * 2**20


def storage_file(path: Path) -> Path:
    return path if path.is_file() else next(p for p in path.iterdir() if p.suffix != '.yaml')


def read(path: Path) -> tuple[list[Record], Bag]:
    with open_bag(path) as bag:
        return list(bag.records()), bag


@pytest.mark.parametrize('kind', KINDS)
def test_cut_anywhere(tmp_path: Path, kind: str) -> None:
    """Cut after every byte of the first 200 and last 300, and at 150 places between."""
    records = sample_records(3, frames=8)
    whole = Counter(records)
    file = storage_file(KINDS[kind][0](tmp_path, records))
    data = file.read_bytes()
    step = max(len(data) // 150, 1)
    places = {*range(200), *range(len(data) - 300, len(data)), *range(0, len(data), step)}
    best = 0
    for size in sorted(places):
        file.write_bytes(data[:size])
        try:
            passed, bag = read(file)
        except BagError:
            continue
        assert not Counter(passed) - whole, f'a wrong message after a cut at {size}'
        assert not bag.complete or len(passed) == len(records), f'silent loss at {size}'
        best = max(best, len(passed))
    # Close before the end nearly all is still there.
    assert best >= len(records) - 15


def test_a_damaged_chunk_costs_its_own_messages_only(mcap: Path, written: list[Record]) -> None:
    file = storage_file(mcap)
    data = bytearray(file.read_bytes())
    # The second chunk: chunks hold five messages of each topic.
    at = [m for m in range(len(data)) if data[m : m + 8] == b'\x04\0\0\0zstd'][1]
    data[at + 40] ^= 0xFF
    file.write_bytes(data)
    passed, bag = read(mcap)
    assert passed == written[:15] + written[30:]
    assert not bag.complete
    assert any('chunk 1 cannot be read' in w for w in bag.warnings)


def test_a_length_that_swallows_the_rest_is_stepped_over(
    mcap: Path, written: list[Record]
) -> None:
    file = storage_file(mcap)
    data = bytearray(file.read_bytes())
    first = data.index(b'\x04\0\0\0zstd')
    at = data.index(b'\x04\0\0\0zstd', first + 1) - 37
    assert data[at] == McapOp.CHUNK
    data[at + 1 : at + 9] = struct.pack('<Q', 2**60)
    # With the index at the end, and without.
    for end in (len(data), len(data) - 700):
        file.write_bytes(data[:end])
        passed, bag = read(mcap)
        assert set(written[:15] + written[30:45]) <= set(passed) <= set(written)
        assert not bag.complete


def test_an_index_that_points_elsewhere(mcap: Path, written: list[Record]) -> None:
    """Flip one offset, then one time, in a message index: the chunk itself tells the truth."""
    file = storage_file(mcap)
    data = file.read_bytes()
    entry = struct.pack('<Q', written[3].stamp)
    for shift in (0, 8):
        place = data.index(entry) + shift
        spoiled = bytearray(data)
        spoiled[place + 1] ^= 1
        file.write_bytes(spoiled)
        passed, bag = read(mcap)
        assert not set(passed) - set(written)
        assert len(passed) == len(written) or not bag.complete
        with open_bag(mcap, thorough=True) as careful:
            assert list(careful.records()) == written


def test_a_flipped_bit_in_a_picture_is_noticed(sample: Sample, written: list[Record]) -> None:
    """Uncompressed chunks have only our checksum to notice it by."""
    folder = sample('mcap plain')
    file = storage_file(folder)
    data = bytearray(file.read_bytes())
    data[data.index(written[1].data[-40:]) + 7] ^= 1
    file.write_bytes(data)
    passed, bag = read(folder)
    assert passed == written[15:]
    assert any('checksum' in w for w in bag.warnings)


def test_wrong_magic(mcap: Path) -> None:
    file = storage_file(mcap)
    file.write_bytes(b'\x88' + file.read_bytes()[1:])
    with pytest.raises(BagError, match='Expected an MCAP file'):
        open_bag(file)


def test_metadata_that_is_none(mcap: Path, written: list[Record]) -> None:
    bombs = ['', '{', '[1, 2]', 'rosbag2_bagfile_information: 7', 'a: &a [1]\nb: *a\n', '\0\1\2']
    layers = '\n'.join(f'l{k}: &l{k} [{", ".join([f"*l{k - 1}"] * 9)}]' for k in range(1, 30))
    for text in [*bombs, f'l0: &l0 x\n{layers}\n', '[' * 100_000]:
        (mcap / 'metadata.yaml').write_text(text)
        passed, bag = read(mcap)
        assert passed == written
        assert bag.warnings[0].startswith('metadata.yaml cannot be used')


def test_metadata_does_not_lead_out_of_the_folder(mcap: Path, tmp_path: Path) -> None:
    storage_file(mcap).rename(tmp_path / 'elsewhere.mcap')
    text = (mcap / 'metadata.yaml').read_text()
    (mcap / 'metadata.yaml').write_text(text.replace('sample.mcap', '../elsewhere.mcap'))
    with pytest.raises(BagError, match='None of the 1 files'):
        open_bag(mcap)


def record(op: int, body: bytes) -> bytes:
    return struct.pack('<BQ', op, len(body)) + body


def text(value: bytes) -> bytes:
    return struct.pack('<I', len(value)) + value


def mcap_with(chunk: bytes) -> bytes:
    return MAGIC + record(McapOp.HEADER, text(b'ros2') + text(b'')) + chunk + MAGIC


def chunk(data: bytes, size: int, method: bytes = b'zstd', crc: int = 0) -> bytes:
    fields = struct.pack('<QQQI', 1, 1, size, crc) + text(method)
    return record(McapOp.CHUNK, fields + struct.pack('<Q', len(data)) + data)


def bombs() -> dict[str, bytes]:
    """Small files that claim or unpack to much."""
    zeros = zstd.compress(bytes(2**20) * 300, level=1)
    tiny = record(McapOp.MESSAGE, struct.pack('<HIQQ', 1, 0, 1, 1))
    # Two and a half million.
    many = tiny * 2_500_000
    return {
        'unpacks to 300 MiB, as it says': mcap_with(chunk(zeros, 300 * 2**20)),
        'unpacks to 300 MiB, says 1 kB': mcap_with(chunk(zeros, 1000)),
        'claims 16 EiB': mcap_with(chunk(zeros, 2**64 - 1)),
        'claims 200 MiB and has 100 bytes': mcap_with(chunk(bytes(100), 200 * 2**20, b'')),
        'millions of messages in one chunk': mcap_with(
            chunk(zstd.compress(many), len(many), crc=crc32(many))
        ),
        'a schema of 8 EiB': mcap_with(struct.pack('<BQ', McapOp.SCHEMA, 2**63)),
        'a message of 8 EiB': mcap_with(struct.pack('<BQ', McapOp.MESSAGE, 2**63)),
        'lz4 that is zstd': mcap_with(chunk(zeros, 1000, b'lz4')),
        'an unknown compression': mcap_with(chunk(zeros, 1000, b'brotli')),
    }


READ_ALL = f"""
import resource, sys
from likeme_bags.errors import BagError
from likeme_bags.reading import open_bag
resource.setrlimit(resource.RLIMIT_AS, ({MEMORY}, {MEMORY}))
for name in sys.argv[1:]:
    try:
        with open_bag(name) as bag:
            print(len(list(bag.records())), bag.complete)
    except BagError as error:
        print(error)
"""


def test_bombs_are_refused_within_bounded_memory(tmp_path: Path) -> None:
    """In a process of its own that may not take more than 1.5 GiB."""
    names = []
    for k, (name, data) in enumerate(bombs().items()):
        (tmp_path / f'{k}.mcap').write_bytes(data)
        names.append(name)
    done = subprocess.run(
        [
            sys.executable,
            '-c',
            READ_ALL,
            *(str(tmp_path / f'{k}.mcap') for k in range(len(names))),
        ],
        capture_output=True,
        text=True,
        timeout=200,
    )
    assert done.returncode == 0, done.stderr
    said = dict(zip(names, done.stdout.splitlines(), strict=True))
    for name, sentence in said.items():
        assert sentence == '0 False' or 'xpected' in sentence, (name, sentence)


def test_a_packed_file_that_unpacks_too_far(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr('likeme_bags.rosbag2_compression.MAX_UNPACKED', 10 * 2**20)
    (tmp_path / 'a.mcap.zstd').write_bytes(zstd.compress(bytes(20 * 2**20)))
    with pytest.raises(BagError, match='unpacks to more than'):
        open_bag(tmp_path / 'a.mcap.zstd')


def test_fuzz_1000(tmp_path: Path) -> None:
    """Run it longer: ../run.sh python ros2_ws/src/likeme_bags/test/fuzz_bags.py --runs N."""
    done = subprocess.run(
        [
            sys.executable,
            Path(__file__).with_name('fuzz_bags.py'),
            '--runs',
            '1000',
            '--seed',
            '7',
        ],
        capture_output=True,
        text=True,
        timeout=280,
    )
    assert done.returncode == 0, done.stderr + done.stdout
    assert '0 broken promises' in done.stdout


def test_the_fuzz_test_would_notice(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """With checksums and counts ignored, wrong messages and silent losses come to light."""
    import fuzz_bags as fuzz

    monkeypatch.setattr('likeme_bags.mcap_format.ChunkHead.crc', 0)
    monkeypatch.setattr('likeme_bags.reading.Bag.complete', True)
    outcomes = list(fuzz.fuzz(200, 0, tmp_path))
    assert any('wrong messages' in o.verdict for o in outcomes)
    assert any('silently' in o.verdict for o in outcomes)


def test_open_files_are_let_go(mcap: Path) -> None:
    """Also by bags that are refused half way."""
    limit = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(limit[0], 200), limit[1]))
    try:
        for k in range(300):
            data = storage_file(mcap).read_bytes()
            (mcap.parent / 'cut.mcap').write_bytes(data[: 40 + k])
            try:
                open_bag(mcap.parent / 'cut.mcap').close()
            except BagError:
                continue
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, limit)

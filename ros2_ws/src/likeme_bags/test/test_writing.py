"""What we write opens in rosbags, keeps what was known, and survives the end of its writer."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
import yaml
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import Reader
from sample_bags import CHATTER, STRING, TOPICS, sample_records

from likeme_bags.editing import repair
from likeme_bags.errors import BagError
from likeme_bags.qos import LATCHED
from likeme_bags.reading import open_bag
from likeme_bags.typestores import jazzy_definition
from likeme_bags.values import Record, Topic
from likeme_bags.writing import BagWriter


@pytest.mark.parametrize('storage', ['mcap', 'sqlite3'])
def test_the_rosbags_library_reads_all_of_it(
    tmp_path: Path, written: list[Record], storage: str
) -> None:
    with BagWriter(tmp_path / 'bag', storage, custom={'seed': '4'}) as writer:
        for topic in TOPICS:
            writer.add(Topic(topic.name, topic.type, qos=(LATCHED,)))
        for record in written:
            writer.write(record)
    with Reader(tmp_path / 'bag') as reader:
        found = [(c.topic, c.msgtype, stamp, data) for c, stamp, data in reader.messages()]
        assert found == [record[:4] for record in written]
    with AnyReader([tmp_path / 'bag']) as reader:
        for connection, _, data in reader.messages():
            reader.deserialize(data, connection.msgtype)
    info = yaml.safe_load((tmp_path / 'bag' / 'metadata.yaml').read_text())
    info = info['rosbag2_bagfile_information']
    assert (info['version'], info['storage_identifier']) == (9, storage)
    assert info['custom_data'] == {'seed': '4'}
    topic = info['topics_with_message_count'][0]['topic_metadata']
    assert topic['offered_qos_profiles'][0]['durability'] == 'transient_local'
    assert topic['type_description_hash'] == jazzy_definition(topic['type'])[1]


def test_definitions_hashes_and_qos_come_back(tmp_path: Path) -> None:
    topic = Topic('/a', STRING, 0, (LATCHED,), 'string data\n# ours', 'ros2msg', 'RIHS01_ab')
    with BagWriter(tmp_path / 'bag') as writer:
        writer.add(topic)
    with open_bag(tmp_path / 'bag') as bag:
        assert bag.topics == (topic,)


def test_refusals(tmp_path: Path, written: list[Record]) -> None:
    with pytest.raises(BagError, match="'mcap' or 'sqlite3', got 'rosbag'"):
        BagWriter(tmp_path / 'a', 'rosbag')
    with BagWriter(tmp_path / 'a') as writer, pytest.raises(BagError, match='was added'):
        writer.write(written[0])
    with pytest.raises(BagError, match='exists'):
        BagWriter(tmp_path / 'a')


# Where the recorders find `sample_bags`.
HERE = Path(__file__).parent
RECORDER = """
import signal, sys
from sample_bags import TOPICS, sample_records
from likeme_bags.writing import BagWriter
writer = BagWriter(sys.argv[1], sys.argv[2])
for topic in TOPICS:
    writer.add(topic)
for k, record in enumerate(sample_records(5, frames=12)):
    writer.write(record)
    if k == 29:
        writer.flush()
print('written', flush=True)
signal.pause()
"""


@pytest.mark.parametrize('storage', ['mcap', 'sqlite3'])
def test_what_was_flushed_survives_kill_9_and_is_mended(tmp_path: Path, storage: str) -> None:
    """36 messages were written, 30 of them flushed."""
    records = sample_records(5, frames=12)
    recorder = subprocess.Popen(
        [sys.executable, '-c', RECORDER, str(tmp_path / 'bag'), storage],
        stdout=subprocess.PIPE,
        cwd=HERE,
    )
    assert recorder.stdout is not None
    assert recorder.stdout.readline() == b'written\n'
    os.kill(recorder.pid, signal.SIGKILL)
    recorder.wait(20)
    recorder.stdout.close()
    before = {p.name: p.read_bytes() for p in (tmp_path / 'bag').iterdir()}
    with open_bag(tmp_path / 'bag') as bag:
        assert list(bag.records()) == records[:30]
    done = repair(tmp_path / 'bag', tmp_path / 'mended', storage)
    assert (done.messages, done.complete) == (30, True)
    with Reader(tmp_path / 'mended') as reader:
        assert reader.message_count == len(list(reader.messages())) == 30
    assert {p.name: p.read_bytes() for p in (tmp_path / 'bag').iterdir()} == before


def test_every_chunk_can_be_read_alone(mcap: Path, written: list[Record]) -> None:
    """The first chunk, and the summary, are gone; the topics are known all the same."""
    file = next(mcap.glob('*.mcap'))
    (mcap / 'metadata.yaml').unlink()
    data = bytearray(file.read_bytes())
    first = data.index(b'\x04\0\0\0zstd')
    data[first + 60] ^= 0xFF
    file.write_bytes(data[:-2500])
    with open_bag(mcap) as bag:
        passed = list(bag.records())
    assert passed == written[15 : 15 + len(passed)]
    assert len(passed) >= 30
    assert CHATTER in {r.topic for r in passed}


@pytest.mark.parametrize('storage', ['mcap', 'sqlite3'])
def test_a_full_disk_is_said_in_one_sentence(tmp_path: Path, storage: str) -> None:
    """Files of this process may not grow past 100 kB: writing fails as on a full disk."""
    code = (
        'import resource, signal, sys\n'
        'from likeme_bags.errors import BagError\n'
        'from sample_bags import TOPICS, sample_records\n'
        'from likeme_bags.writing import BagWriter\n'
        'signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n'
        'resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))\n'
        'try:\n'
        '    with BagWriter(sys.argv[1], sys.argv[2]) as writer:\n'
        '        for topic in TOPICS: writer.add(topic)\n'
        '        for k in range(20):\n'
        '            for record in sample_records(k): writer.write(record)\n'
        '            writer.flush()\n'
        'except BagError as error: print(error)'
    )
    done = subprocess.run(
        [sys.executable, '-c', code, str(tmp_path / 'bag'), storage],
        capture_output=True,
        text=True,
        timeout=60,
        cwd=HERE,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith(f'Cannot write {tmp_path / "bag"}: ')

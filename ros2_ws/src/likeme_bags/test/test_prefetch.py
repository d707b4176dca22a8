"""Chunks that other threads unpack: the same chunks, the same errors, and never too many."""

from __future__ import annotations

import threading
from pathlib import Path

import numpy as np
import pytest

from likeme_bags import prefetch
from likeme_bags.errors import DamagedError
from likeme_bags.images import IMAGE, DecodedImage, image_record
from likeme_bags.prefetch import MAX_PENDING, MIN_SIZE, Prefetcher
from likeme_bags.reading import open_bag
from likeme_bags.values import Topic
from likeme_bags.writing import BagWriter


@pytest.fixture(autouse=True)
def _two_cores(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(prefetch.os, 'sched_getaffinity', lambda _: {0, 1})


class Chunks:
    """Ten chunks; who asks for them, and which are being read."""

    def __init__(self, size: int = MIN_SIZE) -> None:
        self.size = size
        self.readers: dict[int, str] = {}
        self.gate = threading.Event()
        self.gate.set()

    def read(self, number: int) -> str:
        self.readers[number] = threading.current_thread().name
        assert self.gate.wait(30)
        if number == 4:
            raise DamagedError('Expected a chunk, got none.')
        return f'chunk {number}'

    def size_of(self, number: int) -> int:
        return self.size if number < 10 else 0


def test_in_order_the_next_ones_are_read_by_other_threads() -> None:
    chunks = Chunks()
    reader = Prefetcher(chunks.read, chunks.size_of)
    got = []
    for number in range(10):
        try:
            got.append(reader.get(number))
        except DamagedError:
            got.append('damaged')
    reader.close()
    assert got == [f'chunk {n}' if n != 4 else 'damaged' for n in range(10)]
    assert sorted(chunks.readers) == list(range(10))
    # 0 and 1 are asked for before there is an order in it.
    assert all(chunks.readers[n].startswith('prefetch') for n in range(2, 10))


@pytest.mark.parametrize('numbers', [(7, 3, 9, 1), (5, 5), (9, 8, 7)])
def test_without_an_order_nothing_is_read_that_nobody_asked_for(numbers: tuple[int, ...]) -> None:
    chunks = Chunks()
    reader = Prefetcher(chunks.read, chunks.size_of)
    assert [reader.get(n) for n in numbers] == [f'chunk {n}' for n in numbers]
    reader.close()
    assert chunks.readers.keys() == set(numbers)
    assert not any(name.startswith('prefetch') for name in chunks.readers.values())


@pytest.mark.parametrize(
    ('size', 'begun'), [(MIN_SIZE - 1, 0), (MAX_PENDING // 2, 2), (MAX_PENDING + 1, 0)]
)
def test_small_chunks_are_not_worth_it_and_huge_ones_have_no_room(size: int, begun: int) -> None:
    chunks = Chunks(size)
    reader = Prefetcher(chunks.read, chunks.size_of)
    reader.get(0)
    reader.get(1)
    reader.close()
    assert len(chunks.readers) <= 2 + begun
    assert (len(chunks.readers) > 2) == (begun > 0)


def test_closing_waits_for_what_is_being_read() -> None:
    chunks = Chunks()
    reader = Prefetcher(chunks.read, chunks.size_of)
    reader.get(0)
    # 1 is read here, 2 to 4 by the others, who have to wait.
    chunks.gate.clear()
    threading.Timer(0.2, chunks.gate.set).start()
    reader.get(1)
    reader.close()
    assert not any(t.name.startswith('prefetch') for t in threading.enumerate())


def test_without_threads_it_reads_all_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    def none_left(*_: object) -> None:
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr(prefetch.ThreadPoolExecutor, 'submit', none_left)
    chunks = Chunks()
    reader = Prefetcher(chunks.read, chunks.size_of)
    assert [reader.get(n) for n in range(4)] == [f'chunk {n}' for n in range(4)]
    reader.close()


@pytest.mark.parametrize('method', ['zstd', 'lz4'])
def test_a_camera_is_read_the_same_with_and_without_threads(
    method: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whole, and with a flipped bit in the middle: the same records and the same warnings."""
    rng, path = np.random.default_rng(1), tmp_path / 'bag'
    with BagWriter(path, compress=method) as writer:
        writer.add(Topic('/rgb', IMAGE))
        for number in range(12):
            pixels = rng.integers(0, 60, (240, 320, 3), np.uint8)
            writer.write(image_record('/rgb', number, DecodedImage(number, 'c', 'rgb8', pixels)))
            writer.flush()
    file = next(path.glob('*.mcap'))
    whole = file.read_bytes()
    flipped = bytearray(whole)
    flipped[len(whole) // 2] ^= 16
    for data, count in ((whole, 12), (flipped, 11)):
        file.write_bytes(data)
        told = []
        for threads in (2, 1):
            monkeypatch.setattr(prefetch, 'THREADS', threads)
            with open_bag(path) as bag:
                records = list(bag.records())
                told.append((records, bag.warnings, bag.complete))
        assert told[0] == told[1]
        assert len(told[0][0]) == count

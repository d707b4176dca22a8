"""Which files a bag consists of, and what metadata.yaml says of them."""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

from likeme_bags.bag_warnings import BagWarnings, Subject
from likeme_bags.errors import BagError, DamagedError
from likeme_bags.limits import MAX_FILES
from likeme_bags.metadata import NAME, Metadata, read_metadata
from likeme_bags.rosbag2_compression import ENDINGS, without_ending

_KINDS = ('.mcap', '.db3', '.bag')
# Where the parts of a bag have their number: at the end, or as newer rosbag2 has it, in front of
# the name and the date. Longer numbers are dates or stamps.
_AT_END = re.compile(r'(?P<rest>.*)_(?P<n>\d{1,5})')
_IN_FRONT = re.compile(r'(?P<n>\d{1,5})_(?P<rest>(?!\d\d[-_]\d\d).+)')
# Names that end with a date or a time: their last number is no counter. With one behind a date
# and time, as rosbag2 names bags by default, it is.
_DATE_TIME = r'\d{4}[-_]?\d{2}[-_]?\d{2}[-_T]?\d{2}[-_:]?\d{2}[-_:]?\d{2}'
_DATED = re.compile(rf'{_DATE_TIME}$|\d{{2}}[-_:.]\d{{2}}[-_:.]\d{{2}}$')
_COUNTED = re.compile(rf'{_DATE_TIME}_\d{{1,5}}$')


class BagFiles(NamedTuple):
    """The storage files of a bag in the order they were written."""

    files: tuple[Path, ...]
    metadata: Metadata | None


def kind_of(path: Path) -> str:
    """'.mcap', '.db3', '.bag' or '' by a file's name, as it was before it was compressed."""
    name = without_ending(path.name)
    return next((kind for kind in _KINDS if name.endswith(kind)), '')


def find_files(path: Path, log: BagWarnings) -> BagFiles:
    """Look at what a user named: a folder, or one file.

    Raises:
        BagError: nothing there, or nothing that could be a bag.
    """
    if path.is_dir():
        return _in_folder(path, log)
    if not path.exists():
        raise BagError(f'There is no bag {path}.')
    if not kind_of(path):
        raise BagError(f'Expected a folder or a file .mcap, .db3 or .bag, got {path.name}.')
    return BagFiles((path,), None)


def _in_folder(folder: Path, log: BagWarnings) -> BagFiles:
    lying, metadata = _storage_files(folder), _metadata(folder, log)
    if metadata is None or not metadata.files:
        if not lying:
            raise BagError(f'Expected a bag in {folder}, got no {NAME} and no storage file.')
        _warn_of_gaps(lying, log)
        return BagFiles(tuple(lying), metadata)
    files = [_as_it_lies(folder / name) for name in metadata.files]
    there = tuple(each for each in files if each is not None)
    if len(there) < len(files):
        log.loss(Subject.FILES, f'A file that {NAME} lists is missing.')
    if not there and lying:
        log.remark(
            Subject.FILES, f'None of the files in {NAME} is there; those beside it were read.'
        )
        return BagFiles(tuple(lying), metadata)
    if not there:
        raise BagError(f'None of the {len(files)} files that {NAME} lists is in {folder}.')
    if strangers := set(lying) - set(there):
        names = ', '.join(sorted(p.name for p in strangers)[:3])
        log.loss(
            Subject.FILES,
            f'{len(strangers)} files that {NAME} does not list were not read: {names}.',
        )
    return BagFiles(there, metadata)


def _metadata(folder: Path, log: BagWarnings) -> Metadata | None:
    try:
        return read_metadata(folder)
    except FileNotFoundError:
        log.remark(Subject.METADATA, f'{NAME} is missing; the files beside it were read.')
    except DamagedError as error:
        log.remark(
            Subject.METADATA, f'{NAME} cannot be used, the files beside it were read: {error}'
        )
    return None


def _as_it_lies(path: Path) -> Path | None:
    """The file as named, or its compressed or unpacked twin."""
    packed = [path.with_name(path.name + end) for end in ENDINGS]
    twins = (path, *packed, path.with_name(without_ending(path.name)))
    return next((twin for twin in twins if twin.is_file() and kind_of(twin)), None)


def _storage_files(folder: Path) -> list[Path]:
    """Storage files in a folder, `_2` before `_10`; without compressed twins of others."""
    try:
        lying = [p for p in folder.iterdir() if kind_of(p) in ('.mcap', '.db3') and p.is_file()]
    except OSError as error:
        raise BagError(f'Cannot read {folder}: {error.strerror}.') from None
    plain = {p.name for p in lying}
    lying = [p for p in lying if without_ending(p.name) == p.name or p.stem not in plain]
    counters = _counters(lying)
    return sorted(lying, key=lambda p: counters[p])[:MAX_FILES]


def _counters(files: list[Path]) -> dict[Path, tuple[str, int]]:
    """Name without its counter, and the counter (-1: none), of every file.

    Of the two places where it can stand, the one that makes more of the files parts of one bag.
    """
    best: dict[Path, tuple[str, int]] = {}
    for pattern in (_AT_END, _IN_FRONT):
        counters = {path: _counter(_stem(path), pattern) for path in files}
        if not best or _bags(counters) < _bags(best):
            best = counters
    return best


def _bags(counters: dict[Path, tuple[str, int]]) -> int:
    return len({name for name, _ in counters.values()})


def _stem(path: Path) -> str:
    return without_ending(path.name).rpartition('.')[0]


def _counter(stem: str, pattern: re.Pattern[str]) -> tuple[str, int]:
    """Of a name with a counter in front, the dates do not count: each part has its own."""
    match = pattern.fullmatch(stem)
    front = pattern is _IN_FRONT
    dated = _DATED.search(stem) and not _COUNTED.search(stem)
    if match is None or (dated and not front):
        return stem, -1
    rest = re.sub(r'\d+', '#', match['rest']) if front else match['rest']
    return rest, int(match['n'])


def _warn_of_gaps(files: list[Path], log: BagWarnings) -> None:
    """A number that is missing between two parts of a bag is a file that is missing.

    Not one before them: a recorder that keeps the last files only deletes the first.
    """
    parts: dict[str, list[int]] = {}
    for name, number in _counters(files).values():
        if number >= 0:
            parts.setdefault(name, []).append(number)
    for name, numbers in sorted(parts.items()):
        lacking = sorted(set(range(min(numbers), max(numbers))) - set(numbers))
        if lacking and len(set(numbers)) == len(numbers):
            log.loss(
                Subject.FILES,
                f'Expected files {name} numbered {min(numbers)} to {max(numbers)}, got no '
                f'{", ".join(map(str, lacking[:10]))}.',
            )

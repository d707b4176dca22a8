"""Which files a bag consists of, and what metadata.yaml says of them."""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

from likeme_bags.bag_warnings import About, Notes
from likeme_bags.errors import BagError, DamagedError
from likeme_bags.limits import MAX_FILES
from likeme_bags.metadata import NAME, Metadata, read_metadata

_KINDS = ('.mcap', '.db3', '.bag')
_NUMBER = re.compile(r'(\d+)(?=\.(?:mcap|db3|bag)(?:\.zstd)?$)')


class Found(NamedTuple):
    """The storage files of a bag in the order they were written."""

    files: tuple[Path, ...]
    metadata: Metadata | None


def kind_of(path: Path) -> str:
    """'.mcap', '.db3', '.bag' or '' by a file's name; a trailing .zstd is looked through."""
    name = path.name.removesuffix('.zstd')
    return next((kind for kind in _KINDS if name.endswith(kind)), '')


def find(path: Path, notes: Notes) -> Found:
    """Look at what a user named: a folder, or one file.

    Raises:
        BagError: nothing there, or nothing that could be a bag.
    """
    if path.is_dir():
        return _in_folder(path, notes)
    if not path.exists():
        raise BagError(f'There is no bag {path}.')
    if not kind_of(path):
        raise BagError(f'Expected a folder or a file .mcap, .db3 or .bag, got {path.name}.')
    return Found((path,), None)


def _in_folder(folder: Path, notes: Notes) -> Found:
    lying, metadata = _storage_files(folder), _metadata(folder, notes)
    if metadata is None or not metadata.files:
        if not lying:
            raise BagError(f'Expected a bag in {folder}, got no {NAME} and no storage file.')
        _note_gaps(lying, notes)
        return Found(tuple(lying), metadata)
    files = [_as_it_lies(folder / name) for name in metadata.files]
    there = tuple(each for each in files if each is not None)
    if len(there) < len(files):
        notes.loss(About.FILES, f'A file that {NAME} lists is missing.')
    if not there and lying:
        notes.remark(
            About.FILES, f'None of the files in {NAME} is there; those beside it were read.'
        )
        return Found(tuple(lying), metadata)
    if not there:
        raise BagError(f'None of the {len(files)} files that {NAME} lists is in {folder}.')
    if strangers := set(lying) - set(there):
        names = ', '.join(sorted(p.name for p in strangers)[:3])
        notes.loss(
            About.FILES,
            f'{len(strangers)} files that {NAME} does not list were not read: {names}.',
        )
    return Found(there, metadata)


def _metadata(folder: Path, notes: Notes) -> Metadata | None:
    try:
        return read_metadata(folder)
    except FileNotFoundError:
        notes.remark(About.METADATA, f'{NAME} is missing; the files beside it were read.')
    except DamagedError as error:
        notes.remark(
            About.METADATA, f'{NAME} cannot be used, the files beside it were read: {error}'
        )
    return None


def _as_it_lies(path: Path) -> Path | None:
    """The file as named, or its compressed or unpacked twin."""
    twins = (
        path,
        path.with_name(path.name + '.zstd'),
        path.with_name(path.name.removesuffix('.zstd')),
    )
    return next((twin for twin in twins if twin.is_file() and kind_of(twin)), None)


def _storage_files(folder: Path) -> list[Path]:
    """Storage files in a folder, `_2` before `_10`; a packed twin of a file is left out."""
    try:
        lying = [p for p in folder.iterdir() if kind_of(p) in ('.mcap', '.db3') and p.is_file()]
    except OSError as error:
        raise BagError(f'Cannot read {folder}: {error.strerror}.') from None
    plain = {p.name for p in lying}
    lying = [p for p in lying if not (p.suffix == '.zstd' and p.stem in plain)]
    return sorted(lying, key=lambda p: (_number(p), p.name))[:MAX_FILES]


def _number(path: Path) -> int:
    match = _NUMBER.search(path.name)
    return int(match.group(1)[:18]) if match else -1


def _note_gaps(files: list[Path], notes: Notes) -> None:
    """Split bags count from 0: a number that is missing is a file that is missing."""
    numbers = [_number(p) for p in files]
    if len(files) > 1 and numbers != list(range(len(files))):
        notes.loss(
            About.FILES, f'Expected files numbered 0 to {len(files) - 1}, got {numbers[:10]}.'
        )

"""The command behind scripts/bag.sh: look at bags, cut, merge, mend, check and export them."""

from __future__ import annotations

import json
import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from likeme_bags import editing
from likeme_bags.check_results import Level
from likeme_bags.doctor import examine
from likeme_bags.errors import BagError
from likeme_bags.export_csv import export_csv
from likeme_bags.export_lerobot import export_lerobot
from likeme_bags.export_mp4 import export_mp4
from likeme_bags.info import described, in_words
from likeme_bags.reading import open_bag

app = typer.Typer(
    add_completion=False,
    rich_markup_mode=None,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)

Bag = Annotated[Path, typer.Argument(help='A rosbag2 folder, a .mcap, .db3 or ROS 1 .bag file.')]
Out = Annotated[Path, typer.Option('--out', help='Folder of the new bag; must not exist.')]
Topics = Annotated[
    list[str] | None, typer.Option('--topics', help='Only this topic; may be given several times.')
]
AsJson = Annotated[bool, typer.Option('--json', help='One JSON document.')]


class Storage(StrEnum):
    """Storage formats that can be written."""

    MCAP = 'mcap'
    SQLITE3 = 'sqlite3'


StorageOption = Annotated[Storage, typer.Option('--storage', help='Format of the new bag.')]


class Format(StrEnum):
    """What a bag can be exported to."""

    LEROBOT = 'lerobot'
    CSV = 'csv'
    MP4 = 'mp4'


@contextmanager
def _spoken() -> Iterator[None]:
    """Errors as one sentence and exit code 1."""
    try:
        yield
    except BagError as error:
        print(f'bag: {error}', file=sys.stderr)
        raise typer.Exit(1) from None
    except OSError as error:
        print(f'bag: {error.filename or "file"}: {error.strerror}.', file=sys.stderr)
        raise typer.Exit(1) from None


def _warn(warnings: tuple[str, ...], complete: bool) -> None:
    """Say what the bags had to say; exit code 1 when messages are missing."""
    for sentence in warnings:
        print(f'bag: {sentence}', file=sys.stderr)
    if not complete:
        print('bag: messages are missing, or may be.', file=sys.stderr)
        raise typer.Exit(1)


def _said(written: editing.Written) -> None:
    print(f'{written.messages} messages in {written.path}')
    _warn(written.warnings, written.complete)


@app.command()
def info(bag: Bag, as_json: AsJson = False) -> None:
    """What is in a bag."""
    with _spoken(), open_bag(bag) as opened:
        summary = described(opened)
        print(json.dumps(summary, indent=1) if as_json else in_words(summary))
        _warn(() if as_json else opened.warnings, opened.complete)


@app.command()
def cut(
    bag: Bag,
    out: Out,
    start: Annotated[float | None, typer.Option(help='From here, s from the beginning.')] = None,
    end: Annotated[float | None, typer.Option(help='Up to here, s from the beginning.')] = None,
    topics: Topics = None,
    storage: StorageOption = Storage.MCAP,
) -> None:
    """A part of a bag: of its time, of its topics. Also turns any bag into MCAP or sqlite3."""
    with _spoken():
        _said(editing.cut(bag, out, start, end, topics, storage))


@app.command()
def merge(
    bags: Annotated[list[Path], typer.Argument(help='Two or more bags.')],
    out: Out,
    storage: StorageOption = Storage.MCAP,
) -> None:
    """Several bags in one, by the times at which messages were recorded."""
    if len(bags) < 2:
        print(f'bag: expected two or more bags to merge, got {len(bags)}.', file=sys.stderr)
        raise typer.Exit(2)
    with _spoken():
        _said(editing.merge(bags, out, storage))


@app.command()
def repair(
    bag: Bag,
    out: Annotated[
        Path | None, typer.Option(help='New folder; without it BAG_repaired beside the bag.')
    ] = None,
    in_place: Annotated[
        bool, typer.Option(help='Put it in place of the bag, which is kept as BAG.before.')
    ] = False,
    storage: StorageOption = Storage.MCAP,
) -> None:
    """Mend what a cut left: index, metadata.yaml. All that can be read, in a new folder."""
    with _spoken():
        if not (trouble := editing.needs_repair(bag)):
            print(f'{bag}: nothing to mend.')
            return
        target = out or bag.with_name(f'{bag.name.removesuffix(bag.suffix)}_repaired')
        written = editing.repair(bag, target, storage)
        if in_place:
            written = written._replace(path=_swap(bag, target))
        for sentence in trouble:
            print(f'bag: {sentence}', file=sys.stderr)
        _said(written._replace(warnings=()))


def _swap(bag: Path, mended: Path) -> Path:
    """Put the mended folder where the bag was; the bag stays beside it."""
    kept = bag.with_name(f'{bag.name}.before')
    if kept.exists():
        raise BagError(
            f'Expected no {kept}, which an earlier repair left; the new bag is {mended}.'
        )
    bag.rename(kept)
    target = bag if not bag.suffix else bag.with_suffix('')
    if target.exists():
        kept.rename(bag)
        raise BagError(f'Expected no {target}; the new bag is {mended}.')
    shutil.move(mended, target)
    return target


@app.command()
def doctor(bag: Bag, as_json: AsJson = False) -> None:
    """Check a bag: one line a check, exit code 1 when one fails."""
    with _spoken():
        findings = examine(bag)
    if as_json:
        print(json.dumps([finding._asdict() for finding in findings], indent=1))
    else:
        for check, level, sentence in findings:
            print(f'{level:5} {check:14} {sentence}')
    raise typer.Exit(int(any(finding.level == Level.FAIL for finding in findings)))


@app.command()
def export(
    bags: Annotated[list[Path], typer.Argument(help='A bag; for lerobot one or more.')],
    out: Annotated[Path, typer.Option('--out', help='Folder to write into; must not exist.')],
    form: Annotated[Format, typer.Option('--format', help='What to write.')],
    topics: Topics = None,
    fps: Annotated[
        int | None,
        typer.Option(min=1, help="Pictures a second; mp4: the topic's own, lerobot: 30."),
    ] = None,
    task: Annotated[
        list[str] | None, typer.Option(help='What was done, for lerobot: one, or one a bag.')
    ] = None,
) -> None:
    """A bag as tables, as videos, or as a dataset to learn from."""
    if form != Format.LEROBOT and len(bags) != 1:
        print(f'bag: expected one bag for {form}, got {len(bags)}.', file=sys.stderr)
        raise typer.Exit(2)
    with _spoken():
        if out.exists():
            raise BagError(f'Expected a new folder, {out} exists.')
        out.mkdir(parents=True)
        try:
            _export(bags, out, form, topics, fps, task or [])
        except BagError:
            shutil.rmtree(out, ignore_errors=True)
            raise


def _export(
    bags: list[Path],
    out: Path,
    form: Format,
    topics: list[str] | None,
    fps: int | None,
    tasks: list[str],
) -> None:
    if form == Format.LEROBOT:
        folder, complete = export_lerobot(bags, out, fps or 30, tasks)
        print(f'{len(bags)} episodes in {folder}')
        _warn((), complete)
        return
    with open_bag(bags[0]) as bag:
        if form == Format.CSV:
            written = export_csv(bag, out, topics)
        else:
            written = export_mp4(bag, out, topics, fps)
        for path in written:
            print(path)
        _warn(bag.warnings, bag.complete)


def main() -> None:
    """Entry point of `bag`."""
    app(prog_name='bag')


if __name__ == '__main__':
    main()

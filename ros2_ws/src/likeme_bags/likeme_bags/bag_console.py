"""CLI of scripts/bag.sh: inspect, cut, merge, repair, check and export bags."""

import shutil
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Optional

import typer
import typer.core

from likeme_bags import editing
from likeme_bags.check_results import Level
from likeme_bags.doctor import examine
from likeme_bags.errors import BagError, UnsupportedError
from likeme_bags.export_csv import export_csv
from likeme_bags.export_mp4 import export_mp4
from likeme_bags.export_result import Exported
from likeme_bags.info import bag_summary, summary_text
from likeme_bags.reading import open_bag
from likeme_bags.text_output import json_text, one_line
from likeme_bags.usage_errors import run

# For the Typer of Ubuntu 24.04 (0.9), as likeme_core.typer_app, which this package does not
# import: annotations that are not texts, Optional[X] for X | None, no boxes around errors.
if hasattr(typer.core, 'rich'):
    typer.core.rich = None

app = typer.Typer(
    add_completion=False,
    rich_markup_mode=None,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)

Bag = Annotated[Path, typer.Argument(help='A rosbag2 folder, a .mcap, .db3 or ROS 1 .bag file.')]
Out = Annotated[Path, typer.Option('--out', help='Folder of the new bag; must not exist.')]
Topics = Annotated[
    Optional[list[str]],
    typer.Option(
        '--topics', help='Only this topic, with or without leading slash; can be repeated.'
    ),
]
AsJson = Annotated[bool, typer.Option('--json', help='One JSON document.')]


class StorageFormat(StrEnum):
    """Storage formats that can be written."""

    MCAP = 'mcap'
    SQLITE3 = 'sqlite3'


StorageOption = Annotated[StorageFormat, typer.Option('--storage', help='Format of the new bag.')]


class ExportFormat(StrEnum):
    """What a bag can be exported to."""

    LEROBOT = 'lerobot'
    CSV = 'csv'
    MP4 = 'mp4'


@contextmanager
def _errors_as_sentences() -> Iterator[None]:
    """Print errors as one line and exit with code 1."""
    try:
        yield
    except BagError as error:
        _complain(str(error))
        raise typer.Exit(1) from None
    except OSError as error:
        _complain(f'{error.filename or "file"}: {error.strerror}.')
        raise typer.Exit(1) from None


def _complain(sentence: str) -> None:
    print(f'bag: {one_line(sentence)}', file=sys.stderr)


def _wrong_usage(sentence: str) -> typer.Exit:
    _complain(sentence)
    return typer.Exit(2)


def _warn(warnings: Iterable[str], complete: bool) -> None:
    """Print the warnings of the bags read; exit code 1 when messages are missing."""
    for sentence in warnings:
        _complain(sentence)
    if not complete:
        _complain('messages are missing, or may be.')
        raise typer.Exit(1)


def _report(written: editing.WrittenBag) -> None:
    print(f'{written.messages} messages in {written.path}')
    _warn(written.warnings, written.complete)


@app.command()
def info(bag: Bag, as_json: AsJson = False) -> None:
    """Print topics, message counts, rates and times of a bag."""
    with _errors_as_sentences(), open_bag(bag) as opened:
        summary = bag_summary(opened)
        print(json_text(summary, indent=1) if as_json else summary_text(summary))
        _warn(() if as_json else opened.warnings, opened.complete)


@app.command()
def cut(
    bag: Bag,
    out: Out,
    start: Annotated[
        Optional[float], typer.Option(help='First time, s from the beginning.')
    ] = None,
    end: Annotated[
        Optional[float], typer.Option(help='End (excluded), s from the beginning.')
    ] = None,
    topics: Topics = None,
    storage: StorageOption = StorageFormat.MCAP,
) -> None:
    """Write a time range or some topics of a bag; also converts any bag to MCAP or sqlite3."""
    with _errors_as_sentences():
        _report(editing.cut(bag, out, start, end, topics, storage))


@app.command()
def merge(
    bags: Annotated[list[Path], typer.Argument(help='Two or more bags.')],
    out: Out,
    storage: StorageOption = StorageFormat.MCAP,
) -> None:
    """Write several bags into one, in the order of their log times."""
    if len(bags) < 2:
        raise _wrong_usage(f'expected two or more bags to merge, got {len(bags)}.')
    with _errors_as_sentences():
        _report(editing.merge(bags, out, storage))


@app.command()
def repair(
    bag: Bag,
    out: Annotated[
        Optional[Path], typer.Option(help='New folder; without it BAG_repaired beside the bag.')
    ] = None,
    in_place: Annotated[
        bool, typer.Option(help='Replace the bag, which is kept as BAG.before.')
    ] = False,
    storage: StorageOption = StorageFormat.MCAP,
) -> None:
    """Write all that can be read into a new bag with index and metadata.yaml."""
    with _errors_as_sentences():
        if not (trouble := editing.needs_repair(bag)):
            print(f'{bag}: nothing to repair.')
            return
        target = out or bag.with_name(f'{bag.name.removesuffix(bag.suffix)}_repaired')
        written = editing.repair(bag, target, storage)
        if in_place:
            written = written._replace(path=_swap(bag, target))
        _warn(trouble, True)
        _report(written._replace(warnings=()))


def _swap(bag: Path, repaired: Path) -> Path:
    """Move the repaired folder to where the bag was, and the bag to a name beside it."""
    kept = bag.with_name(f'{bag.name}.before')
    if kept.exists():
        raise BagError(
            f'Expected no {kept}, which an earlier repair left; the new bag is {repaired}.'
        )
    bag.rename(kept)
    target = bag if not bag.suffix else bag.with_suffix('')
    if target.exists():
        kept.rename(bag)
        raise BagError(f'Expected no {target}; the new bag is {repaired}.')
    shutil.move(repaired, target)
    return target


@app.command()
def doctor(bag: Bag, as_json: AsJson = False) -> None:
    """Check a bag: one line per check, exit code 1 when one fails."""
    with _errors_as_sentences():
        results = examine(bag)
    if as_json:
        print(json_text([{'check': name, **r._asdict()} for name, r in results.items()], indent=1))
    else:
        for name, (level, sentence) in results.items():
            print(f'{level:5} {name:14} {one_line(sentence)}')
    raise typer.Exit(int(any(result.level == Level.FAIL for result in results.values())))


@app.command()
def export(
    bags: Annotated[list[Path], typer.Argument(help='A bag; for lerobot one or more.')],
    out: Annotated[Path, typer.Option('--out', help='Folder to write into; must not exist.')],
    form: Annotated[ExportFormat, typer.Option('--format', help='What to write.')],
    topics: Topics = None,
    fps: Annotated[
        Optional[int],
        typer.Option(min=1, max=240, help="Hz; mp4: default the topic's own, lerobot: 30."),
    ] = None,
    task: Annotated[
        Optional[list[str]], typer.Option(help='What was done, for lerobot: one, or one per bag.')
    ] = None,
) -> None:
    """Write a bag as tables, as videos, or as a LeRobot dataset."""
    if form != ExportFormat.LEROBOT and len(bags) != 1:
        raise _wrong_usage(f'expected one bag for {form}, got {len(bags)}.')
    if form != ExportFormat.LEROBOT and task:
        raise _wrong_usage(f'expected --task with --format lerobot, got it with {form}.')
    if form == ExportFormat.CSV and fps:
        raise _wrong_usage(f'expected --fps with --format mp4 or lerobot, got it with {form}.')
    with _errors_as_sentences():
        if out.exists():
            raise BagError(f'Expected a new folder, {out} exists.')
        out.mkdir(parents=True)
        try:
            exported = _export(bags, out, form, topics, fps, task or [])
        except BaseException as error:
            shutil.rmtree(out, ignore_errors=True)
            if isinstance(error, UnsupportedError):
                raise BagError(f'{error} Choose others with --topics.') from None
            raise
        if form == ExportFormat.LEROBOT:
            print(f'{len(bags)} episodes in {out}')
        else:
            print(*exported.paths, sep='\n')
        _warn(exported.remarks, exported.complete)


def _export(
    bags: list[Path],
    out: Path,
    form: ExportFormat,
    topics: list[str] | None,
    fps: int | None,
    tasks: list[str],
) -> Exported:
    if form == ExportFormat.LEROBOT:
        return _export_lerobot(bags, out, topics, fps or 30, tasks)
    with open_bag(bags[0]) as bag:
        if form == ExportFormat.CSV:
            exported = export_csv(bag, out, topics)
        else:
            exported = export_mp4(bag, out, topics, fps)
        return exported._replace(remarks=[*exported.remarks, *bag.warnings])


def _export_lerobot(
    bags: list[Path], out: Path, topics: list[str] | None, fps: int, tasks: list[str]
) -> Exported:
    # It brings pyarrow, an extra that takes 0.1 s to import and that rosdep does not know.
    try:
        from likeme_bags.export_lerobot import export_lerobot
    except ModuleNotFoundError as error:
        raise BagError(
            f'Expected the Python package {error.name} for --format lerobot: '
            f'install it from pip (python3 -m pip install {error.name}).'
        ) from None
    return export_lerobot(bags, out, topics, fps, tasks)


def main() -> None:
    """Entry point of `bag`."""
    run(app, Path(sys.argv[0]).name)


if __name__ == '__main__':
    main()

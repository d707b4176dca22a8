"""`record`: write down what the cell says, or make the shipped recordings anew."""

from __future__ import annotations

import os
import sys
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from likeme_bags.adapting import COLOUR, DEPTH, INFO
from likeme_bags.durable import DurableWriter
from likeme_bags.errors import BagError
from likeme_bringup.replaying.recording import Recording, summary
from likeme_bringup.replaying.script import FRAME_DONE, HEARD
from likeme_bringup.start_cell import Domain

#: What a replay needs, and what people look at.
TOPICS = (
    COLOUR, DEPTH, INFO, 'table_state', FRAME_DONE, 'demonstration', 'goal_belief', 'decision',
    'outcome', HEARD, 'joint_states', '/clock', '/diagnostics',
)  # fmt: skip
#: Where recordings go that are named without a folder.
FOLDER = Path('out/bags')
SUITE = Path('bags')


class Storage(StrEnum):
    """The file's format."""

    MCAP = 'mcap'
    SQLITE3 = 'sqlite3'


class Compression(StrEnum):
    """How it is packed."""

    LZ4 = 'lz4'
    ZSTD = 'zstd'
    NONE = 'none'


#: What is read fastest, where the format has it.
USUAL = {Storage.MCAP: Compression.LZ4, Storage.SQLITE3: Compression.ZSTD}


def record(
    name: Annotated[
        list[str] | None,
        typer.Argument(help='Folder of the new bag; with --suite names of shipped ones.'),
    ] = None,
    all_topics: Annotated[bool, typer.Option('--all', help='Every topic there is.')] = False,
    topics: Annotated[
        list[str] | None, typer.Option(help='This topic instead of the usual; may be repeated.')
    ] = None,
    storage: Annotated[Storage, typer.Option(help='The format.')] = Storage.MCAP,
    compression: Annotated[
        Compression | None, typer.Option(help='How it is packed (default: lz4; sqlite3: zstd).')
    ] = None,
    duration: Annotated[float | None, typer.Option(min=0.1, help='s, then end.')] = None,
    suite: Annotated[
        bool, typer.Option('--suite', help='Make the shipped recordings anew, without ROS.')
    ] = False,
    out: Annotated[Path | None, typer.Option(help='Folder for them (default: bags).')] = None,
    domain: Domain = 0,
) -> None:
    """Record until Ctrl-C. A killed recorder leaves a bag short of its last second.

    Exit codes: 0 done; 1 messages were lost or nothing was recorded; 2 usage.
    """
    os.environ['ROS_DOMAIN_ID'] = str(domain)
    names = name or []
    if suite:
        raise typer.Exit(_suite(out or SUITE, names))
    if len(names) != 1:
        raise typer.BadParameter(f'expected one NAME, got {len(names)}')
    if out is not None or (all_topics and topics):
        raise typer.BadParameter('expected --out with --suite, and --all without --topics')
    path = Path(names[0]) if '/' in names[0] else FOLDER / names[0]
    wanted = None if all_topics else tuple(topics or TOPICS)
    try:
        packed = compression or USUAL[storage]
        recording = Recording(DurableWriter(path, storage.value, packed.value))
        recording.start()
    except (BagError, OSError) as error:
        print(f'record: {error}', file=sys.stderr)
        raise typer.Exit(2) from None
    # Only here: the suite has no need of ROS.
    from likeme_bringup.replaying.record_node import listen

    print(f'Recording to {path}; Ctrl-C ends it.')
    missing, lost, unusable = listen(recording, wanted, duration, domain)
    raise typer.Exit(_conclude(path, recording, missing, lost, unusable))


def _conclude(
    path: Path,
    recording: Recording,
    missing: list[str],
    lost: dict[str, int],
    unusable: dict[str, str],
) -> int:
    for line in summary(recording.counts, missing):
        print(line)
    said = [f'{count} messages of {topic} were lost.' for topic, count in lost.items() if count]
    said += [f'{topic} was not recorded: {why}' for topic, why in unusable.items()]
    if recording.error:
        said.append(f'Writing ended early: {recording.error}')
    if not recording.counts.total():
        said.append('Expected messages, got none: is the cell running on this ROS domain?')
    for sentence in said:
        print(f'record: {sentence}', file=sys.stderr)
    print(f'{recording.counts.total()} messages in {path}')
    return 1 if said else 0


def _suite(folder: Path, names: list[str]) -> int:
    from likeme_bringup.replaying.suite import recipes
    from likeme_bringup.replaying.suite_writer import write_suite

    known = {recipe.name: recipe for recipe in recipes()}
    unknown = [name for name in names if name not in known]
    if unknown:
        print(f'record: expected one of {", ".join(known)}, got {unknown[0]}.', file=sys.stderr)
        return 2
    write_suite(folder, [r for r in known.values() if not names or r.name in names])
    return 0


app = typer.Typer(add_completion=False, rich_markup_mode=None)
app.command()(record)


def main() -> None:
    """Entry point of `record`."""
    app(prog_name='record')


if __name__ == '__main__':
    main()

"""`record`: record the topics of a running cell into a bag."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from likeme_bags.camera_topics import COLOUR, DEPTH, INFO
from likeme_bags.durable import DurableWriter
from likeme_bags.errors import BagError
from likeme_core.cli import Domain
from likeme_core.progress_bar import StatusLine
from likeme_core.typer_app import App
from likeme_replay.recorded_inputs import FRAME_DONE, HEARD
from likeme_replay.recording_writer import Recording, summary

#: Topics that a replay needs, and those for inspection.
TOPICS = (
    COLOUR, DEPTH, INFO, 'table_state', FRAME_DONE, 'demonstration', 'goal_belief', 'decision',
    'outcome', HEARD, 'world', 'joint_states', 'tf', 'tf_static', 'robot_description', '/clock',
    '/diagnostics', 'attempt', 'joint_goal_belief',
)  # fmt: skip
#: s between two looks at the size of a recording.
TELL_PERIOD = 0.5
#: Folder of recordings that are named without one.
FOLDER = Path('out/bags')


class RecordingFormat(StrEnum):
    """The file's format."""

    MCAP = 'mcap'
    SQLITE3 = 'sqlite3'


class Compression(StrEnum):
    """Compression of the file."""

    LZ4 = 'lz4'
    ZSTD = 'zstd'
    NONE = 'none'


#: The compression of each format that is read fastest.
DEFAULT_COMPRESSION = {
    RecordingFormat.MCAP: Compression.LZ4,
    RecordingFormat.SQLITE3: Compression.ZSTD,
}


def record(
    name: Annotated[str, typer.Argument(help='Folder of the new bag.')],
    all_topics: Annotated[bool, typer.Option('--all', help='All topics.')] = False,
    topics: Annotated[
        list[str] | None,
        typer.Option(help='This topic instead of the default ones; may be repeated.'),
    ] = None,
    storage: Annotated[RecordingFormat, typer.Option(help='The format.')] = RecordingFormat.MCAP,
    compression: Annotated[
        Compression | None, typer.Option(help='Compression (default: lz4; sqlite3: zstd).')
    ] = None,
    duration: Annotated[float | None, typer.Option(min=0.1, help='Stop after so many s.')] = None,
    domain: Domain = 0,
) -> None:
    """Record until Ctrl-C. A killed recorder leaves a bag short of its last second.

    Exit codes: 0 done; 1 messages were lost or nothing was recorded; 2 usage.
    """
    os.environ['ROS_DOMAIN_ID'] = str(domain)
    if all_topics and topics:
        raise typer.BadParameter('expected --all without --topics')
    path = Path(name) if '/' in name else FOLDER / name
    wanted = None if all_topics else tuple(topics or TOPICS)
    try:
        packing = compression or DEFAULT_COMPRESSION[storage]
        recording = Recording(DurableWriter(path, storage.value, packing.value))
        recording.start()
    except (BagError, OSError) as error:
        print(f'record: {error}', file=sys.stderr)
        raise typer.Exit(2) from None
    # Imported here: rclpy takes 0.3 s, which --help need not wait for.
    from likeme_replay.ros.record_node import record_topics

    print(f'Recording to {path}; stop with Ctrl-C.')
    line = StatusLine('Recording', duration)
    with line.shown():
        gaps = record_topics(recording, wanted, duration, domain, _teller(line, recording, path))
    missing, lost, unusable = gaps
    raise typer.Exit(_report(path, recording, missing, lost, unusable))


def _report(
    path: Path,
    recording: Recording,
    missing: list[str],
    lost: dict[str, int],
    unusable: dict[str, str],
) -> int:
    for line in summary(recording.counts, missing):
        print(line)
    problems = [
        f'{count} messages of {topic} were lost.' for topic, count in lost.items() if count
    ]
    problems += [f'{topic} was not recorded: {why}' for topic, why in unusable.items()]
    if recording.error:
        problems.append(f'Writing ended early: {recording.error}')
    if not recording.counts.total():
        problems.append('Expected messages, got none: is the cell running on this ROS domain?')
    for sentence in problems:
        print(f'record: {sentence}', file=sys.stderr)
    print(f'{recording.counts.total()} messages, {_megabytes(path)} in {path}')
    return 1 if problems else 0


def _teller(line: StatusLine, recording: Recording, path: Path) -> Callable[[], None]:
    """Says now and then how much is recorded."""
    due = 0.0

    def tell() -> None:
        nonlocal due
        if time.monotonic() >= due:
            due = time.monotonic() + TELL_PERIOD
            line.say(f'{recording.counts.total()} messages, {_megabytes(path)}')

    return tell


def _megabytes(path: Path) -> str:
    return f'{sum(file.stat().st_size for file in path.glob("*")) / 1e6:.1f} MB'


app = App(add_completion=False, rich_markup_mode=None)
app.command()(record)


def main() -> None:
    """Entry point of `record`."""
    app()


if __name__ == '__main__':
    main()

"""`replay`: replay a recording into the graph, in lockstep with the nodes, or offline."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

from likeme_bags.errors import BagError
from likeme_core.cli import Domain
from likeme_core.typer_app import App
from likeme_core.yaml_files import read_yaml
from likeme_replay.offline_replay import replay_offline
from likeme_replay.replay_options import ReplayOptions
from likeme_replay.replay_report import print_message, report
from likeme_replay.source_adapters import adapted_source, parse_pairs


def replay(
    bag: Annotated[Path, typer.Argument(help='Folder or file of the recording.')],
    rate: Annotated[
        float | None,
        typer.Option(min=0.0, help='Recorded s per s; 0: as fast as possible.'),
    ] = None,
    start: Annotated[float | None, typer.Option(min=0.0, help='s after the start.')] = None,
    end: Annotated[float | None, typer.Option(min=0.0, help='s after the start.')] = None,
    loop: Annotated[bool, typer.Option('--loop', help='Repeat until Ctrl-C.')] = False,
    pause: Annotated[
        bool,
        typer.Option('--pause', help='Begin paused. Keys: space (continue), n (step), q (quit).'),
    ] = False,
    topics: Annotated[
        list[str] | None, typer.Option(help='Play this topic only; may be repeated.')
    ] = None,
    remap: Annotated[
        list[str] | None, typer.Option(metavar='FROM:=TO', help='Give a topic another name.')
    ] = None,
    type_map: Annotated[
        list[str] | None,
        typer.Option(metavar='FROM:=TO', help='Read a type as another of the same layout.'),
    ] = None,
    clock: Annotated[bool, typer.Option('--clock', help='Publish /clock, monotone.')] = False,
    qos: Annotated[
        Path | None, typer.Option(help='YAML file of QoS overrides: topic: policy: value.')
    ] = None,
    lockstep: Annotated[
        bool,
        typer.Option('--lockstep', help='Wait until the nodes have processed each frame.'),
    ] = False,
    offline: Annotated[
        bool, typer.Option('--offline', help='In this process, without a network.')
    ] = False,
    log: Annotated[
        Path | None,
        typer.Option(help='Write the decision log here (-: stdout); implies --lockstep.'),
    ] = None,
    world: Annotated[
        str | None,
        typer.Option(
            metavar='NAME|FILE', help='World of the nodes; default: the recorded one.'
        ),
    ] = None,
    params: Annotated[
        Path | None, typer.Option(help='ROS parameter file for perception and inference.')
    ] = None,
    running: Annotated[
        bool,
        typer.Option('--running', help='In lockstep: use running nodes, never start any.'),
    ] = False,
    domain: Domain = 0,
) -> None:  # fmt: skip
    """Replay a recording.

    Exit codes: 0 done; 1 it failed, no frame was read, or the bag is damaged; 2 usage.
    """
    os.environ['ROS_DOMAIN_ID'] = str(domain)
    with _error_messages():
        options = ReplayOptions(
            bag, rate, start, end, loop, pause, tuple(topics or ()),
            parse_pairs(remap or (), '--remap'), parse_pairs(type_map or (), '--type-map'), clock,
            read_yaml(qos) if qos else {}, lockstep or bool(log), offline, log, params, world,
            running, domain,
        )  # fmt: skip
        options.check()
    with _error_messages(failed=1):
        raise typer.Exit(_run(options))


def _run(options: ReplayOptions) -> int:
    if options.offline:
        return _replay_offline(options)
    # Imported here: offline replays need no ROS.
    from likeme_replay.ros import network_replay

    if options.lockstep:
        return network_replay.replay_in_lockstep(options)
    return network_replay.play(options)


def _replay_offline(options: ReplayOptions) -> int:
    parameters, begin, end = options.read_bag_settings()
    source = adapted_source(options.remap, options.types)
    return report(options, replay_offline(options.bag, parameters, source, begin, end))


@contextmanager
def _error_messages(failed: int = 2) -> Iterator[None]:
    """Print errors as one sentence and exit with a code."""
    try:
        yield
    except BagError as error:
        print_message(str(error))
        raise typer.Exit(1) from None
    except (ValueError, OSError) as error:
        print_message(' '.join(str(error).split()))
        raise typer.Exit(failed) from None
    except KeyboardInterrupt:
        raise typer.Exit(130) from None


app = App(add_completion=False, rich_markup_mode=None)
app.command()(replay)


def main() -> None:
    """Entry point of `replay`."""
    app()


if __name__ == '__main__':
    main()

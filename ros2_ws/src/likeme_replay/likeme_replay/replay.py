"""`replay`: play a recording into the graph, in lockstep, or straight through the cores."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

from likeme_bags.errors import BagError
from likeme_core.cli import Domain
from likeme_core.yaml_files import read_yaml
from likeme_replay.offline_replay import replay_offline
from likeme_replay.replay_options import Options
from likeme_replay.replay_report import conclude, say
from likeme_replay.source_adapters import adapted, pairs


def replay(
    bag: Annotated[Path, typer.Argument(help='Folder or file of the recording.')],
    rate: Annotated[
        float | None,
        typer.Option(min=0.0, help='Recorded s per s; 0: as fast as it goes.'),
    ] = None,
    start: Annotated[float | None, typer.Option(min=0.0, help='s after the start.')] = None,
    end: Annotated[float | None, typer.Option(min=0.0, help='s after the start.')] = None,
    loop: Annotated[bool, typer.Option('--loop', help='Again and again, until Ctrl-C.')] = False,
    pause: Annotated[
        bool,
        typer.Option('--pause', help='Begin paused. Keys: space go on, n single step, q end.'),
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
        typer.Option('--lockstep', help='Wait until the nodes have done with each frame.'),
    ] = False,
    offline: Annotated[
        bool, typer.Option('--offline', help='Through the same cores without a network.')
    ] = False,
    log: Annotated[
        Path | None,
        typer.Option(help='Write the decision log here (-: stdout); implies --lockstep.'),
    ] = None,
    params: Annotated[
        Path | None, typer.Option(help='ROS parameter file for perception and inference.')
    ] = None,
    running: Annotated[
        bool,
        typer.Option('--running', help='In lockstep: never with nodes of its own.'),
    ] = False,
    domain: Domain = 0,
) -> None:  # fmt: skip
    """Replay a recording.

    Exit codes: 0 done; 1 it failed, or the bag is not whole; 2 usage.
    """
    os.environ['ROS_DOMAIN_ID'] = str(domain)
    with _sentences():
        given = Options(
            bag, rate, start, end, loop, pause, tuple(topics or ()), pairs(remap or (), '--remap'),
            pairs(type_map or (), '--type-map'), clock, read_yaml(qos) if qos else {},
            lockstep or bool(log), offline, log, params, running, domain,
        )  # fmt: skip
        given.check()
    with _sentences(failed=1):
        raise typer.Exit(_run(given))


def _run(given: Options) -> int:
    if given.offline:
        return _offline(given)
    # Only here: without a network there is no need of ROS.
    from likeme_replay.ros import network_replay as playing_node

    if given.lockstep:
        return playing_node.lockstep(given)
    return playing_node.play(given)


def _offline(given: Options) -> int:
    parameters, begin, end = given.of_bag()
    source = adapted(given.remap, given.types)
    replayed = replay_offline(given.bag, parameters, source, begin, end)
    return conclude(given, replayed)


@contextmanager
def _sentences(failed: int = 2) -> Iterator[None]:
    """Errors as one sentence and an exit code."""
    try:
        yield
    except BagError as error:
        say(str(error))
        raise typer.Exit(1) from None
    except (ValueError, OSError) as error:
        say(' '.join(str(error).split()))
        raise typer.Exit(failed) from None
    except KeyboardInterrupt:
        raise typer.Exit(130) from None


app = typer.Typer(add_completion=False, rich_markup_mode=None)
app.command()(replay)


def main() -> None:
    """Entry point of `replay`."""
    app(prog_name='replay')


if __name__ == '__main__':
    main()

"""`view`: a recording or the running cell in Rerun's viewer, or written as its recording."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Annotated, NoReturn

import typer

from likeme_core.cli import Domain, Network
from likeme_core.typer_app import App
from likeme_replay.viewer.live_source import LiveSource

#: File name ending of Rerun's recordings.
ENDING = '.rrd'

app = App(add_completion=False, rich_markup_mode=None)


@app.command()
def view(
    source: Annotated[
        Path | None,
        typer.Argument(metavar='[BAG | FILE.rrd]', help='A recording of any RGB-D camera.'),
    ] = None,
    live: Annotated[bool, typer.Option('--live', help='Show the running cell.')] = False,
    web: Annotated[bool, typer.Option('--web', help='In a browser of this host.')] = False,
    port: Annotated[int, typer.Option(min=1, max=65535, help='TCP port of --web.')] = 9090,
    save: Annotated[
        Path | None, typer.Option(metavar='FILE.rrd', help='Write it; with --web show it, too.')
    ] = None,
    world: Annotated[
        str | None,
        typer.Option(
            metavar='NAME|FILE',
            help='World of the cell; default: the recorded one, or the shipped one of its name.',
        ),
    ] = None,
    seconds: Annotated[
        float | None, typer.Option(min=0.1, help='With --live: end after so many s.')
    ] = None,
    network: Network = False,
    domain: Domain = 0,
) -> None:
    """Show camera, states, 3-D cell with the arm, beliefs and decisions over time."""
    os.environ['ROS_DOMAIN_ID'] = str(domain)
    if live == (source is not None):
        got = f'both --live and {source}' if live else 'neither'
        _refuse(f'Expected a recording or --live, got {got}; see --help.')
    if seconds is not None and not live:
        _refuse(f'Expected --seconds with --live, got it with {source}.')
    if save is not None:
        _check_save(save, source)
    try:
        # Imported here: only scripts/view.sh installs rerun, which takes 0.6 s to import.
        from likeme_replay.viewer import show
    except ImportError as error:
        _refuse(
            'Expected the Python packages rerun-sdk and pyarrow, which scripts/view.sh installs, '
            f'got: {error}.'
        )
    web_port = port if web else None
    if source is None:
        cell = LiveSource(domain, network, world, seconds)
        code = show.show_live(cell, save, web_port)
    elif source.suffix == ENDING:
        code = show.show_saved(source, web_port)
    else:
        code = show.show_recording(source, save, web_port, world)
    raise typer.Exit(code)


def _check_save(save: Path, source: Path | None) -> None:
    if save.suffix != ENDING:
        _refuse(f'Expected --save FILE{ENDING}, got {save}.')
    if not save.parent.is_dir():
        _refuse(f'Expected --save in a folder that exists, got {save.parent}.')
    if source is not None and source.suffix == ENDING:
        _refuse(f'Expected a bag to --save, got {source}, which is saved already.')


def _refuse(sentence: str) -> NoReturn:
    print(f'view: {sentence}', file=sys.stderr)
    raise typer.Exit(2)


def main() -> None:
    """Entry point of `view`."""
    app()


if __name__ == '__main__':
    main()

"""`foxglove`: a live bridge to the Foxglove application."""

from __future__ import annotations

import os
import sys
from typing import Annotated

import typer

from likeme_core.cli import Domain
from likeme_core.typer_app import App


def bridge(
    host: Annotated[
        str, typer.Option(help='Address to listen on; 0.0.0.0: every one of this host.')
    ] = '127.0.0.1',
    port: Annotated[int, typer.Option(min=1, max=65535, help='TCP port.')] = 8765,
    domain: Domain = 0,
) -> None:
    """Serve all topics until Ctrl-C. Nobody is asked who he is: see --host."""
    os.environ['ROS_DOMAIN_ID'] = str(domain)
    try:
        from likeme_replay.ros.foxglove_bridge_node import FoxgloveBridgeNode
    except ModuleNotFoundError as error:
        if error.name != 'foxglove':
            raise
        print(
            'foxglove: foxglove-sdk is not installed; scripts/foxglove.sh does that.',
            file=sys.stderr,
        )
        raise typer.Exit(2) from None
    from likeme_core.ros.spin import run_node

    def create() -> FoxgloveBridgeNode:
        node = FoxgloveBridgeNode(host, port)
        print(f'ROS domain {domain} at ws://{host}:{node.port}: in Foxglove, "Open connection".')
        return node

    raise typer.Exit(run_node('foxglove', create, [], (RuntimeError, OSError)))


app = App(add_completion=False, rich_markup_mode=None)
app.command()(bridge)


def main() -> None:
    """Entry point of `foxglove`."""
    app()


if __name__ == '__main__':
    main()

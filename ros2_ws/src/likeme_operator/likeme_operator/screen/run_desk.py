"""Opens the screen of the desk on a ROS domain."""

from __future__ import annotations

import threading

import typer

from likeme_operator.desk_node import DeskNode
from likeme_operator.history import History
from likeme_operator.operator_node import operator_node
from likeme_operator.screen.desk_app import DeskApp


def run_desk(by: str, network: bool, domain: int, skip_after: float) -> None:
    """Show the desk until `q`."""
    with operator_node(by, network, domain, DeskNode) as node:
        threading.Thread(target=_read_log, args=(node, domain), daemon=True).start()
        code = DeskApp(node, skip_after).run()
    raise typer.Exit(code or 0)


def _read_log(node: DeskNode, domain: int) -> None:
    # SQLAlchemy takes 0.3 s to import.
    from likeme_operator.logged_history import add_logged

    earlier = History()
    add_logged(earlier, domain, node.get_namespace())
    node.add_earlier(earlier)

"""`policies`: check the policies of a running cell or of recordings, or list them."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Annotated

import typer

from likeme_bags.errors import BagError
from likeme_bags.reading import open_bag
from likeme_core.cli import Domain
from likeme_core.typer_app import App
from likeme_replay.policies.bag_check import check_bag
from likeme_replay.policies.catalogue import POLICIES, table

#: Violations that are printed for one bag.
SHOWN = 20

app = App(add_completion=False, rich_markup_mode=None, no_args_is_help=True)


@app.command()
def check(bags: Annotated[list[Path], typer.Argument(help='Recordings.')]) -> None:
    """Check recorded bags."""
    failed = [path for path in bags if not _check(path)]
    raise typer.Exit(1 if failed else 0)


@app.command()
def watch(domain: Domain = 0) -> None:
    """Check a running cell until Ctrl-C; violations are errors in the log and on /diagnostics."""
    os.environ['ROS_DOMAIN_ID'] = str(domain)
    # Imported here: recordings are checked without ROS.
    from likeme_replay.ros import policy_monitor_node

    raise typer.Exit(policy_monitor_node.main())


@app.command(name='list')
def list_policies() -> None:
    """Print all policies as a Markdown table."""
    print(table())


def _check(path: Path) -> bool:
    """Check one bag and print the result; whether no policy is broken."""
    try:
        with open_bag(path) as bag:
            monitor, unreadable = check_bag(bag)
    except BagError as error:
        print(f'policies: {error}', file=sys.stderr)
        return False
    for violation in list(monitor.violations)[:SHOWN]:
        print(f'{path}: {violation.time:.3f} s: {violation.policy}: {violation.sentence}')
    broken = sum(monitor.counts.values())
    print(
        f'{path}: {broken} violations of {len(POLICIES)} policies in {monitor.messages} messages'
        + (f', {unreadable} messages could not be read.' if unreadable else '.')
    )
    return not broken and not unreadable


def main() -> None:
    """Entry point of `policies`."""
    app()


if __name__ == '__main__':
    main()

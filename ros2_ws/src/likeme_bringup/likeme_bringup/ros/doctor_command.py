"""`doctor`: what of this machine and of a running cell is to be mended, one line each.

Exit codes: 0 healthy, 1 something is to be mended, 2 wrong usage.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from typing import Annotated

import typer

from likeme_bringup.doctor_checks import Finding, machine_findings
from likeme_core.cli import Domain, Network, set_discovery
from likeme_core.typer_app import App


def doctor(
    as_json: Annotated[bool, typer.Option('--json', help='One JSON document.')] = False,
    network: Network = False,
    domain: Domain = 0,
) -> None:
    """Check environment, domain, discovery, DDS profile, buffers, and the topics of a cell."""
    os.environ['ROS_DOMAIN_ID'] = str(domain)
    set_discovery(network)
    findings = []
    for finding in _all(network, domain):
        findings.append(finding)
        if not as_json:
            print(finding.line)
    if as_json:
        print(json.dumps([_as_json(each) for each in findings], indent=2))
    raise typer.Exit(1 if any(each.cure for each in findings) else 0)


def _all(network: bool, domain: int) -> Iterator[Finding]:
    yield from machine_findings(os.environ)
    # Here, so that what is above is said also where ROS cannot be started.
    from likeme_bringup.ros.graph_checks import graph_findings
    from likeme_bringup.ros.service_client import client_node

    try:
        with client_node(network, domain) as node:
            yield from graph_findings(node)
    except RuntimeError as error:
        sentence = f'ROS domain {domain} cannot be joined: {error}.'
        yield Finding('cell', sentence, 'Mend what is above first.')


def _as_json(finding: Finding) -> dict[str, object]:
    return {'ok': not finding.cure, **finding._asdict()}


app = App(add_completion=False, rich_markup_mode=None)
app.command()(doctor)


def main() -> None:
    """Entry point of `doctor`."""
    app()


if __name__ == '__main__':
    main()

"""Command `watch`: a line for everything that happens in a cell."""

from __future__ import annotations

import json
import queue
import time
from datetime import datetime
from typing import Annotated

import typer

from likeme_core.cli import Domain, Network, user_name
from likeme_operator.operator_node import SERVICE_TIMEOUT, SILENCE, OperatorNode
from likeme_operator.ros.cell_events import CellEvent
from likeme_operator.ros.command_output import connected, fail
from likeme_operator.ros.event_stream import EventStream

#: s between two looks at the health of the nodes.
HEALTH_PERIOD = 0.1


class WatchNode(OperatorNode):
    """Puts all events into a queue, those of the nodes' health too.

    Attributes:
        events: with whether each may have happened before this node was there.
    """

    def __init__(self, by: str) -> None:
        """by: name of the operator."""
        super().__init__(by)
        self.events: queue.SimpleQueue[tuple[CellEvent, bool]] = queue.SimpleQueue()
        self._health: dict[str, str] = {}
        EventStream(
            self, lambda: self.names, lambda event, old: self.events.put((event, old)), True
        )

    def note_health(self) -> None:
        """Put an event for each node whose health has changed."""
        now = time.monotonic()
        for name, record in list(self.monitor.nodes.items()):
            silent = self.monitor.silence(name, now) > SILENCE
            state = 'silent' if silent else record.state.name.lower()
            if self._health.get(name) != state:
                self._health[name] = state
                why = '' if silent or not record.message else f': {record.message}'
                event = CellEvent('node', f'{name} {state}{why}', {'node': name, 'state': state})
                self.events.put((event, False))


def watch_command(
    as_json: Annotated[bool, typer.Option('--json', help='A JSON document a line.')] = False,
    count: Annotated[
        int, typer.Option('--count', '-n', min=0, help='End after so many events; 0: never.')
    ] = 0,
    network: Network = False,
    domain: Domain = 0,
) -> None:
    """Print a line for everything that happens, until Ctrl-C. Exit code 3: no cell.

    That is each demonstration, belief, decision, answer, motion, outcome, hold, resume and change
    of a node's health.
    """
    with connected(user_name(), network, domain, as_json, create=WatchNode) as node:
        if not node.until(lambda: node.monitor.nodes, SERVICE_TIMEOUT):
            fail(
                3,
                f'No node is heard on ROS domain {domain} within {SERVICE_TIMEOUT:g} s: is the '
                'cell running? Start it: ./scripts/start_cell.sh',
                as_json,
            )
        node.wait_for_world()
        shown = 0
        while not count or shown < count:
            node.note_health()
            try:
                event, old = node.events.get(timeout=HEALTH_PERIOD)
            except queue.Empty:
                continue
            typer.echo(event_json(event, old) if as_json else event_line(event, old))
            shown += 1


def event_line(event: CellEvent, old: bool) -> str:
    """An event with the time of day at which it was heard."""
    return f'{"earlier " if old else datetime.now().strftime("%H:%M:%S")}  {event.line}'


def event_json(event: CellEvent, old: bool) -> str:
    """An event on a line; `heard`: null if it may have happened before."""
    heard = None if old else datetime.now().astimezone().isoformat(timespec='milliseconds')
    fields = {'heard': heard, 'kind': event.kind, 'sentence': event.sentence, **event.data}
    return json.dumps(fields)

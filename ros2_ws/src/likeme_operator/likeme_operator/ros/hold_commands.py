"""Commands `hold` and `resume`."""

from __future__ import annotations

from typing import Any

import typer

from likeme_arm.ros.stop_command import CONFIRMATION_TIMEOUT, DISCOVERY_TIMEOUT
from likeme_core.cli import Domain, Network
from likeme_core.ros.qos import LATCHED
from likeme_msgs.msg import Decision, TableState
from likeme_operator.operator_node import OperatorNode
from likeme_operator.resume_notice import resume_notice
from likeme_operator.ros.command_output import Json, Name, connected, emit, fail

#: s to wait for a view of the table before a resume.
VIEW_TIMEOUT = 1.0
KEEPER = (
    f'Expected a hold keeper within {DISCOVERY_TIMEOUT:g} s, heard none: is the cell running? '
    'Start it: ./scripts/start_cell.sh'
)


def hold_command(
    by: Name, as_json: Json = False, network: Network = False, domain: Domain = 0
) -> None:
    """Hold every motion until it is resumed. Exit code 1: not confirmed, 3: no cell."""
    with connected(by, network, domain, as_json) as node:
        if not node.wait_for_keeper(DISCOVERY_TIMEOUT):
            fail(3, KEEPER, as_json)
        delay = node.stop(by)
    if delay is None:
        fail(
            1,
            f'STOP was sent, and not confirmed within {CONFIRMATION_TIMEOUT:g} s. Use the '
            'hardware stop.',
            as_json,
        )
    emit(
        as_json, {'held': True, 'confirmed_after': delay, 'by': by},
        f'HELD, confirmed after {delay * 1e3:.0f} ms. `operator.sh resume` allows motion again.',
    )  # fmt: skip


class ResumingNode(OperatorNode):
    """Knows what a resume would move.

    Subscribes: table_state (TableState), decision (Decision)
    """

    def __init__(self, by: str) -> None:
        """by: name of the operator."""
        super().__init__(by)
        self._table: TableState | None = None
        self._decision: Decision | None = None
        self.create_subscription(TableState, 'table_state', self._on_table, 1)
        self.create_subscription(Decision, 'decision', self._on_decision, LATCHED)

    def notice(self) -> list[str]:
        """The sentences of resume_notice."""
        self.until(lambda: self._table is not None, VIEW_TIMEOUT)
        table, state, decision = self._table, self.hold_state, self._decision
        return resume_notice(
            None if state is None else state.held,
            None if table is None else table.hand_in_view,
            None if table is None else table.arm_in_view,
            None if decision is None else int(decision.kind == Decision.ASK_HUMAN),
            decision.object if decision and decision.kind == Decision.AT_GOAL else '',
        )

    def _on_table(self, message: TableState) -> None:
        self._table = message

    def _on_decision(self, message: Decision) -> None:
        self._decision = message


def resume_command(
    by: Name,
    dry: bool = typer.Option(False, '--dry-run', help='Say what would move, and resume nothing.'),
    as_json: Json = False,
    network: Network = False,
    domain: Domain = 0,
) -> None:
    """Say what will move, and allow motion again. Exit code 1: refused, 3: no cell."""
    with connected(by, network, domain, as_json, create=ResumingNode) as node:
        if not node.wait_for_keeper(DISCOVERY_TIMEOUT):
            fail(3, KEEPER, as_json)
        moves = node.notice()
        if not as_json:
            typer.echo('\n'.join(moves))
        response: Any = None if dry else node.resume()
    if response is not None and not response.success:
        fail(1, response.message, as_json)
    message = 'Nothing was resumed.' if response is None else response.message
    emit(as_json, {'resumed': response is not None, 'moves': moves, 'message': message}, message)

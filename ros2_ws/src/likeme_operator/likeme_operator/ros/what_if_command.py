"""Command `whatif`: what another mode or threshold would have decided."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import closing
from typing import Annotated, Any

import typer

from likeme_bringup.enum_choice import choices, member
from likeme_core.cli import Domain, Network, user_name
from likeme_core.state_folder import state_folder
from likeme_core.tabletop import Mode
from likeme_inference.experience.store_error import StoreError
from likeme_inference.ros.decision_records import DecisionRecordSubscriber
from likeme_operator.action_evidence import ActionEvidence, evidence
from likeme_operator.operator_node import OperatorNode
from likeme_operator.ros.command_output import Json, connected, emit, fail
from likeme_operator.what_if import Alternative, WhatIf

#: s to wait for the topic decision_record.
RECORD_TIMEOUT = 3.0


class RecordNode(OperatorNode):
    """Receives decision_record."""

    def __init__(self, by: str) -> None:
        """by: name of the operator."""
        super().__init__(by)
        self._subscriber = DecisionRecordSubscriber(self)

    def record(self, number: int | None) -> Mapping[str, Any] | None:
        """The record of a decision, None: the newest; None if none comes."""
        records = self._subscriber.records
        wanted = lambda: records if number is None else number in records  # noqa: E731
        if not self.until(wanted, RECORD_TIMEOUT):
            return None
        return records[max(records) if number is None else number]


def what_if_command(
    number: Annotated[
        int | None,
        typer.Argument(metavar='[DECISION]', min=1, help='Its number; none: the newest one.'),
    ] = None,
    mode: Annotated[str, typer.Option(help=f'Another mode: {choices(Mode)}; none: all.')] = '',
    threshold: Annotated[
        float | None, typer.Option(min=0, max=1, help='Another threshold; none: as it was.')
    ] = None,
    as_json: Json = False,
    network: Network = False,
    domain: Domain = 0,
) -> None:
    """Tell what another mode or threshold would have decided; nothing is changed.

    The record of the decision comes from the running cell, or else from the decision log of this
    host. Exit code 1: there is no such decision.
    """
    wanted = member(Mode, mode) if mode else None
    with connected(user_name(), network, domain, as_json, create=RecordNode) as node:
        record = node.record(number)
    try:
        if record is None:
            record = logged_record(number, domain)
        question = WhatIf(record)
    except (StoreError, OSError) as error:
        fail(1, f'No running cell tells of it, and the decision log: {error}', as_json)
    except (KeyError, ValueError, TypeError) as error:
        fail(1, f'Expected the full record of a decision, got: {error}.', as_json)
    found = question.modes(threshold) if wanted is None else [question.under(wanted, threshold)]
    made = question.made.decision
    assert made is not None, 'What was decided can be decided.'
    rows = evidence(made, question.inputs)
    data = {
        'decision': made.id,
        'object': made.object,
        'made': question.made.as_json(),
        'alternatives': [each.as_json() for each in found],
        'evidence': [row._asdict() for row in rows],
    }
    emit(as_json, data, what_if_text(question, found, rows))


def what_if_text(question: WhatIf, found: list[Alternative], rows: list[ActionEvidence]) -> str:
    """The alternatives as lines."""
    made = question.made.decision
    assert made is not None, 'What was decided can be decided.'
    return '\n'.join([
        f'Decision {made.id}: {made.sentence}',
        'Trials of each action from this state:',
        *(
            f'  {row.action:16} {row.success:.2f}  {row.successes}/{row.trials} trials, '
            f'95 % {row.low:.2f} to {row.high:.2f}'
            for row in rows
        ),
        'What if (nothing is changed):',
        *(f'  {each.line}' for each in found),
    ])  # fmt: skip


def logged_record(number: int | None, domain: int) -> Mapping[str, Any]:
    """The record of a decision in the log of this host; None: of the newest.

    Raises:
        StoreError, OSError: there is no log, or no such decision.
    """
    # SQLAlchemy takes 0.3 s to import.
    from likeme_inference.experience.decision_log import LOG_FILE, DecisionLog
    from likeme_inference.log_story import DecisionStory, names_of

    place = str(state_folder(domain, '/') / LOG_FILE)
    with closing(DecisionLog(place, create=False)) as log:
        if number is None:
            entry = log.newest('decision')
            if entry is None:
                raise StoreError(f'{place} has no decision yet.')
        else:
            entry = DecisionStory(log, number).decision
        return {**entry.data, 'names': names_of(log, entry.data['world'])}

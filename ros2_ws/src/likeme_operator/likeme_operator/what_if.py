"""What another mode or threshold would have decided, from the record of a decision.

Nothing is asked of the cell: the record holds the trials, the view and the settings.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

from likeme_core.tabletop import Mode
from likeme_core.world import World
from likeme_inference.decision_record import Inputs, decided, recorded_inputs, recorded_world
from likeme_inference.tabletop.action_selection import Kind
from likeme_inference.tabletop.values import Decision


class Alternative(NamedTuple):
    """What would be decided.

    Attributes:
        mode, threshold: that are supposed.
        decision: None: there is none, `reason` says why.
    """

    mode: Mode
    threshold: float
    decision: Decision | None
    reason: str = ''

    @property
    def sure(self) -> float:
        """What the threshold is held against, NaN without an action.

        It is the plan's value in the sequential mode, and else the predicted success.
        """
        if self.decision is None:
            return float('nan')
        value, success = self.decision.plan_value, self.decision.predicted_success
        return value if self.mode is Mode.SEQUENTIAL else success

    @property
    def verb(self) -> str:
        """What the robot would do: acts, asks or nothing."""
        if self.decision is None:
            return 'cannot decide'
        return VERBS[self.decision.kind]

    @property
    def line(self) -> str:
        """The alternative on one line."""
        rule = self.mode.name.lower()
        if self.mode in (Mode.INTERACTIVE, Mode.SEQUENTIAL):
            rule += f', threshold {self.threshold:g}'
        if self.decision is None:
            return f'{rule}: {self.reason}'
        if self.decision.action is None:
            return f'{rule}: {self.verb}'
        many = f' within {self.decision.actions_left}' if self.mode is Mode.SEQUENTIAL else ''
        return f'{rule}: {self.verb}, {self.decision.action.name}, p {self.sure:.2f}{many}'

    def as_json(self) -> dict[str, Any]:
        """The same for programs."""
        made = self.decision
        action = None if made is None or made.action is None else made.action.name
        return {
            'mode': self.mode.name.lower(),
            'threshold': self.threshold,
            'kind': None if made is None else made.kind.name,
            'action': action,
            'p': None if action is None else self.sure,
            'actions_left': None if made is None else made.actions_left,
            'sentence': self.reason if made is None else made.sentence,
        }


VERBS = {
    Kind.EXECUTE: 'acts',
    Kind.ASK_HUMAN: 'asks',
    Kind.AT_GOAL: 'is at the goal',
    Kind.NO_ACTION: 'does nothing',
}


class WhatIf:
    """Makes one recorded decision again under other settings."""

    def __init__(self, record: Mapping[str, Any], world: World | None = None) -> None:
        """Read a record, of the topic decision_record or of a log.

        world: of its names; None: they are in the record.

        Raises:
            KeyError, ValueError, TypeError: the record is incomplete.
        """
        self._world = recorded_world(record['names']) if world is None else world
        self._inputs = recorded_inputs(record, self._world)
        self._number = int(record['decision']['id'])
        self.made = self.under()

    @property
    def inputs(self) -> Inputs:
        """What the decision was made from."""
        return self._inputs

    def under(self, mode: Mode | None = None, threshold: float | None = None) -> Alternative:
        """What would be decided in another mode, or with another threshold.

        Raises:
            ValueError: a threshold outside 0 to 1.
        """
        now = self._inputs.settings
        mode = now.mode if mode is None else mode
        threshold = now.threshold if threshold is None else threshold
        settings = replace(now, mode=mode, threshold=threshold)
        try:
            made = decided(self._inputs._replace(settings=settings), self._number)
        except ValueError as error:
            return Alternative(mode, threshold, None, str(error))
        return Alternative(mode, threshold, made)

    def modes(self, threshold: float | None = None) -> list[Alternative]:
        """What each mode would decide."""
        return [self.under(mode, threshold) for mode in Mode]

"""Decisions and how they ended, in their order."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from likeme_inference.console_replies import WORD_OF
from likeme_operator.desk_view import HistoryRow

#: Decisions that are kept.
KEPT = 200
HOW = {'EXECUTE': 'acted', 'ASK_HUMAN': 'ASKING', 'NO_ACTION': 'no action'}
#: What an answer is called in a row.
REPLIES = {reply.name: word for reply, word in WORD_OF.items()}


class History:
    """Rows by the decisions' numbers; decisions that find the object at its goal are left out."""

    def __init__(self) -> None:
        self._rows: dict[int, HistoryRow] = {}

    @property
    def rows(self) -> tuple[HistoryRow, ...]:
        """The rows, oldest first."""
        return tuple(self._rows[number] for number in sorted(self._rows))

    def decided(self, time: str, decision: Mapping[str, Any]) -> None:
        """Take in a decision: `id`, `object`, `x_i`, `goal`, `choice`, `action` and `p`.

        time: of the day; empty: before this desk was there.
        """
        number, choice = int(decision['id']), str(decision['choice'])
        if choice not in HOW or number in self._rows:
            return
        self._rows[number] = HistoryRow(
            time,
            number,
            str(decision['object']),
            f'{decision["x_i"]}>{decision["goal"]}',
            str(decision['action'] or ''),
            float(decision['p'] if decision['p'] is not None else 'nan'),
            HOW[choice],
            '',
        )
        while len(self._rows) > KEPT:
            del self._rows[min(self._rows)]

    def add_earlier(self, earlier: History) -> None:
        """Add the rows of another history where this one has none, or only an untimed one."""
        for number, row in earlier._rows.items():
            if number not in self._rows or not self._rows[number].time:
                self._rows[number] = row

    def answered(self, number: int | None, reply: str, by: str) -> None:
        """Take in an answer."""
        if number in self._rows:
            told = f'{by}: {REPLIES.get(reply, reply)}'
            self._rows[number] = replace(self._rows[number], how=told)

    def ended(self, number: int, result: str) -> None:
        """Take in an outcome."""
        if number in self._rows:
            row = self._rows[number]
            how = 'asked' if row.how == HOW['ASK_HUMAN'] else row.how
            self._rows[number] = replace(row, how=how, result=result)

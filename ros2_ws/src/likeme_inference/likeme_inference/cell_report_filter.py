"""Leaves out reports of the cell that are in the decision log already."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from likeme_inference.experience.decision_log import DecisionLog


KINDS = ('hold', 'resume', 'motion')
#: Reports that are remembered: more than the topics keep for those who come later.
REMEMBERED = 1000


class CellReportFilter:
    """Remembers holds and resumes by their change, motions by their id and state."""

    def __init__(self, reports: Iterable[tuple[str, Mapping[str, Any]]] = ()) -> None:
        """reports: kind and fields of those that are known."""
        self._known: dict[Hashable, None] = {}
        for kind, data in reports:
            self.is_new(kind, data)

    @classmethod
    def of(cls, log: DecisionLog | None) -> CellReportFilter:
        """Knows the last reports of a log.

        Raises:
            StoreError: it cannot be read.
        """
        entries = () if log is None else log.entries(KINDS, REMEMBERED)
        return cls((entry.kind, entry.data) for entry in entries)

    def is_new(self, kind: str, data: Mapping[str, Any]) -> bool:
        """Whether a report is new; it is remembered."""
        motion = (data.get('id'), data.get('state'))
        key: Hashable = motion if kind == 'motion' else (kind, data.get('change'))
        if key in self._known:
            return False
        if len(self._known) == REMEMBERED:
            self._known.pop(next(iter(self._known)))
        self._known[key] = None
        return True

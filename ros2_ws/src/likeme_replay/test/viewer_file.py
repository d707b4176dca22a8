"""Reads a file that `view --save` has written."""

from __future__ import annotations

from collections import defaultdict
from pathlib import Path
from typing import Any, NamedTuple

from rerun.chunk import RrdReader

from likeme_replay.viewer.scene_stream import TIMELINE


class Row(NamedTuple):
    """One entry of an entity: its stamp, ns (None: static), and its components by their names."""

    stamp: int | None
    values: dict[str, Any]


class ViewerFile:
    """All rows by entity, in the order of their stamps.

    Attributes:
        entities: names, without the leading slash.
    """

    def __init__(self, path: Path) -> None:
        self._rows: dict[str, list[Row]] = defaultdict(list)
        for chunk in RrdReader(path).store().stream():
            batch = chunk.to_record_batch()
            names = [n for n in batch.schema.names if ':' in n]
            for k in range(batch.num_rows):
                stamp = None if chunk.is_static else batch.column(TIMELINE)[k].value
                values = {n.partition(':')[2]: batch.column(n)[k].as_py() for n in names}
                self._rows[chunk.entity_path.lstrip('/')].append(Row(stamp, values))
        for rows in self._rows.values():
            rows.sort(key=lambda row: -1 if row.stamp is None else row.stamp)

    @property
    def entities(self) -> set[str]:
        """Names of all entities."""
        return set(self._rows)

    def rows(self, entity: str) -> list[Row]:
        """The timed rows of an entity."""
        return [row for row in self._rows[entity] if row.stamp is not None]

    def static(self, entity: str) -> dict[str, Any]:
        """The static components of an entity."""
        return {n: v for row in self._rows[entity] if row.stamp is None
                for n, v in row.values.items() if v is not None}  # fmt: skip

    @property
    def story(self) -> list[str]:
        """The sentences of the text log."""
        return [row.values['text'][0] for row in self.rows('story')]

"""Messages as rows of a table: nested fields by dotted names, long arrays by their length."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

# Longer arrays are pictures or clouds, which no table is for.
_LONGEST = 64


def flat(message: object, name: str = '') -> Iterator[tuple[str, Any]]:
    """(column, value) of every field; times in ns, short arrays as JSON, others as `N items`."""
    if type(message).__name__.endswith(('__Time', '__Duration')):
        yield name, int(message.sec) * 10**9 + int(message.nanosec)  # type: ignore[attr-defined]
    elif is_dataclass(message):
        for each in fields(message):
            if each.name not in ('__msgtype__', 'structure_needs_at_least_one_member'):
                column = f'{name}.{each.name}' if name else each.name
                yield from flat(getattr(message, each.name), column)
    elif isinstance(message, np.ndarray | list):
        yield name, _array(message)
    else:
        yield name, message


def _array(values: Any) -> str:
    if len(values) > _LONGEST:
        return f'{len(values)} items'
    return json.dumps([_plain(value) for value in values])


def _plain(value: Any) -> Any:
    if is_dataclass(value):
        return dict(flat(value))
    return value.item() if isinstance(value, np.generic) else value

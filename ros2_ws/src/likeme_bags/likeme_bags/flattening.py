"""Messages as rows of a table: nested fields by dotted names, long arrays by their length."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from likeme_bags.text_output import json_text

# Longer arrays are those of images or point clouds.
_LONGEST = 64


def flatten(message: object, name: str = '') -> Iterator[tuple[str, Any]]:
    """(column, value) of every field; times in ns, short arrays as JSON, others as `N items`."""
    if _is_time(message):
        yield name, _nanoseconds(message)
    elif is_dataclass(message):
        for field in _fields_of(message):
            column = f'{name}.{field}' if name else field
            yield from flatten(getattr(message, field), column)
    elif isinstance(message, np.ndarray | list):
        long = len(message) > _LONGEST
        yield name, f'{len(message)} items' if long else json_text(_json_value(message))
    else:
        yield name, message


def _json_value(value: Any) -> Any:
    """A field as JSON has it; messages as objects."""
    if _is_time(value):
        return _nanoseconds(value)
    if is_dataclass(value):
        return {field: _json_value(getattr(value, field)) for field in _fields_of(value)}
    if isinstance(value, np.ndarray | list):
        long = len(value) > _LONGEST
        return f'{len(value)} items' if long else [_json_value(each) for each in value]
    return value


def _fields_of(message: Any) -> list[str]:
    hidden = ('__msgtype__', 'structure_needs_at_least_one_member')
    return [field.name for field in fields(message) if field.name not in hidden]


def _is_time(message: object) -> bool:
    return type(message).__name__ in (
        'builtin_interfaces__msg__Time',
        'builtin_interfaces__msg__Duration',
    )


def _nanoseconds(message: Any) -> int:
    return int(message.sec) * 10**9 + int(message.nanosec)

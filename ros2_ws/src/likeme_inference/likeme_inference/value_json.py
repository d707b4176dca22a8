"""The session's values as JSON, and back: states, actions and enums by their names.

NaN is null. Floats are written with all their digits, so that they come back as they were.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from functools import cache
from types import UnionType
from typing import Any, TypeVar, get_args, get_origin, get_type_hints

from likeme_core.tabletop import Action, State
from likeme_core.world import World

T = TypeVar('T')
#: In the metadata of fields with a default that older records lack.
ADDED = 'added'


def to_json(value: Any) -> Any:
    """A value as dicts, lists, texts and numbers.

    Raises:
        TypeError: it has something else in it.
    """
    if isinstance(value, (State, Action, Enum)):
        return value.name
    if is_dataclass(value) and not isinstance(value, type):
        return {field.name: to_json(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, Mapping):
        return {str(key): to_json(item) for key, item in value.items()}
    if isinstance(value, (tuple, list)):
        return [to_json(item) for item in value]
    if isinstance(value, float):
        return None if math.isnan(value) else float(value)
    if value is None or isinstance(value, (bool, int, str)):
        return value
    raise TypeError(f'Expected a value of the session, got {type(value).__name__}.')


def to_text(value: Any) -> str:
    """The one text of a JSON value: sorted keys, no spaces."""
    return json.dumps(
        value, sort_keys=True, separators=(',', ':'), ensure_ascii=False, allow_nan=False
    )


def from_json(kind: type[T], data: Any, world: World) -> T:
    """The dataclass whose `to_json` gave `data`.

    Raises:
        ValueError: a field is missing or unknown, or does not have its type.
    """
    wanted: Any = kind
    hints: dict[str, Any] = _hints(wanted)
    needed = {field.name for field in fields(wanted) if ADDED not in field.metadata}
    if not isinstance(data, dict) or not needed <= set(data) <= set(hints):
        got = sorted(data) if isinstance(data, dict) else type(data).__name__
        raise ValueError(f'Expected a {kind.__name__} of {sorted(hints)}, got {got}.')
    try:
        return kind(**{name: _read(hints[name], value, world) for name, value in data.items()})
    except (TypeError, KeyError) as error:
        raise ValueError(f'Expected the fields of a {kind.__name__}, got {error}.') from error


@cache
def _hints(kind: Any) -> dict[str, Any]:
    hints = get_type_hints(kind)
    return {field.name: hints[field.name] for field in fields(kind)}


def _read(hint: Any, data: Any, world: World) -> Any:
    if get_origin(hint) is UnionType:
        (inner,) = (arm for arm in get_args(hint) if arm is not type(None))
        return None if data is None else _read(inner, data, world)
    if get_origin(hint) is tuple:
        return _read_tuple(get_args(hint), data, world)
    if get_origin(hint) is Mapping:
        item = get_args(hint)[1]
        return {key: _read(item, value, world) for key, value in data.items()}
    if hint is State:
        return world.state(str(data))
    if hint is Action:
        return world.action(str(data))
    if issubclass(hint, Enum):
        return hint[data]
    if is_dataclass(hint):
        return from_json(_class(hint), data, world)
    if hint is float and data is None:
        return math.nan
    wanted = (int, float) if hint is float else hint
    if not isinstance(data, wanted) or (isinstance(data, bool) and hint is not bool):
        raise TypeError(f'{data!r} instead of {hint.__name__}')
    return hint(data)


def _class(hint: Any) -> type[Any]:
    assert isinstance(hint, type), 'The types of fields are classes.'
    return hint


def _read_tuple(items: tuple[Any, ...], data: Any, world: World) -> tuple[Any, ...]:
    if not isinstance(data, list):
        raise TypeError(f'{data!r} instead of a list')
    if len(items) == 2 and items[1] is Ellipsis:
        return tuple(_read(items[0], value, world) for value in data)
    if len(items) != len(data):
        raise TypeError(f'{len(data)} items instead of {len(items)}')
    return tuple(_read(hint, value, world) for hint, value in zip(items, data, strict=True))

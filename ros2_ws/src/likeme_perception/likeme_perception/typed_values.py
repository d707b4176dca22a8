"""Type checks of values from JSON and parameters."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from reprlib import repr as shortened
from typing import Any, NoReturn


def number(name: str, value: Any) -> float:
    """A number that is not NaN."""
    if isinstance(value, bool) or not isinstance(value, int | float) or value != value:
        _refuse(name, 'a number', value)
    try:
        return float(value)
    except OverflowError:
        _refuse(name, 'a number', value)


def whole_number(name: str, value: Any) -> int:
    """An integer."""
    if isinstance(value, bool) or not isinstance(value, int):
        _refuse(name, 'a whole number', value)
    return value


def flag(name: str, value: Any) -> bool:
    """True or false."""
    if not isinstance(value, bool):
        _refuse(name, 'true or false', value)
    return value


def text(name: str, value: Any) -> str:
    """A string."""
    if not isinstance(value, str):
        _refuse(name, 'text', value)
    return value


def texts(name: str, value: Any) -> tuple[str, ...]:
    """A list of strings."""
    if not isinstance(value, list | tuple):
        _refuse(name, 'a list of names', value)
    return tuple(text(name, item) for item in value)


def numbers(name: str, value: Any, count: int) -> tuple[float, ...]:
    """A list of `count` numbers."""
    if not isinstance(value, list | tuple):
        _refuse(name, f'a list of {count} numbers', value)
    if len(value) != count:
        raise ValueError(f'Expected {name} as {count} numbers, got {len(value)}.')
    return tuple(number(name, item) for item in value)


def triple(name: str, value: Any) -> tuple[float, float, float]:
    """A list of three numbers."""
    first, second, third = numbers(name, value, 3)
    return first, second, third


def read_text(path: Path) -> str:
    """The text of a file.

    Raises:
        ValueError: it is not UTF-8.
    """
    try:
        return path.read_text(encoding='utf-8')
    except UnicodeDecodeError as error:
        raise ValueError(f'Expected text in UTF-8 in {path}, got other bytes.') from error


def json_mapping(content: str, source: Path) -> dict[str, Any]:
    """The mapping in a JSON text; source: file named in errors.

    Raises:
        ValueError: it is not a mapping with names as keys.
    """
    try:
        values = json.loads(content)
    except (json.JSONDecodeError, RecursionError) as error:
        raise ValueError(f'Expected JSON in {source}, got {error}.') from error
    return _mapping(values, source)


def _mapping(values: Any, source: Path | None) -> dict[str, Any]:
    if not isinstance(values, dict):
        raise ValueError(f'Expected "name: value" in {source}, got {type(values).__name__}.')
    return {text(f'the names in {source}', name): value for name, value in values.items()}


def require(name: str, keys: set[str], value: Any) -> Mapping[str, Any]:
    """A mapping that has some keys."""
    if not isinstance(value, dict):
        raise ValueError(f'Expected "key: value" for {name!r}, got {shortened(value)}.')
    missing = keys - set(value)
    if missing:
        raise ValueError(f'Expected {min(missing)!r} of {name!r}, got {shortened(list(value))}.')
    return value


def _refuse(name: str, kind: str, value: Any) -> NoReturn:
    raise ValueError(f'Expected {name} as {kind}, got {shortened(value)}.')

"""Problems of a world file's structure, as sentences with expected and got."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from functools import cache
from typing import Any

import jsonschema

from likeme_core.tabletop import Manner
from likeme_core.world.folder import WORLDS_FOLDER
from likeme_core.world.located_yaml import LocatedYaml, Problem

_TYPES = {
    'object': 'a mapping',
    'array': 'a list',
    'string': 'text',
    'number': 'a number',
    'integer': 'a whole number',
    'boolean': 'true or false',
}


def schema_problems(located: LocatedYaml) -> list[Problem]:
    """Where the data do not fit the schema."""
    validator = jsonschema.Draft202012Validator(schema())
    told = [
        problem
        for error in validator.iter_errors(located.data)
        for problem in _told(error, located)
    ]
    # JSON has no NaN and no infinity, so that a schema cannot refuse them.
    return told or list(_not_finite(located.data, (), located))


@cache
def schema() -> dict[str, Any]:
    """The JSON schema of format 1, with the manners that there are."""
    content: dict[str, Any] = json.loads((WORLDS_FOLDER / 'world.schema.json').read_text())
    content['$defs']['manner']['enum'] = [manner.name.lower() for manner in Manner]
    return content


def _not_finite(
    value: Any, path: tuple[str | int, ...], located: LocatedYaml
) -> Iterator[Problem]:
    if isinstance(value, float) and not math.isfinite(value):
        where = _name(list(path))
        yield Problem(located.line(path), f'Expected {where} as a finite number, got {value}.')
    elif isinstance(value, dict):
        for key, item in value.items():
            yield from _not_finite(item, (*path, key), located)
    elif isinstance(value, list):
        for index, item in enumerate(value):
            yield from _not_finite(item, (*path, index), located)


def _told(error: Any, located: LocatedYaml) -> Iterator[Problem]:
    path = list(error.absolute_path)
    where, line = _name(path), located.line(path)
    got, limit = error.instance, error.validator_value
    match error.validator:
        case 'required':
            missing = [key for key in limit if key not in got]
            yield Problem(line, f"Expected '{missing[0]}' in {where}, got none.")
        case 'additionalProperties':
            known = error.schema['properties']
            for key in got:
                if key not in known:
                    names = ', '.join(known)
                    line = located.line([*path, str(key)])
                    yield Problem(line, f"Expected one of {names} in {where}, got '{key}'.")
        case 'oneOf':
            names = ', '.join(choice['required'][0] for choice in limit)
            given = ', '.join(
                choice['required'][0] for choice in limit if choice['required'][0] in got
            )
            yield Problem(
                line, f'Expected exactly one of {names} in {where}, got {given or "none"}.'
            )
        case _:
            yield Problem(line, f'Expected {where} as {_expected(error)}, got {_shown(got)}.')


def _expected(error: Any) -> str:
    """What a value should be, from the violated keyword of the schema."""
    limit = error.validator_value
    match error.validator:
        case 'type':
            types = [limit] if isinstance(limit, str) else limit
            return ' or '.join(_TYPES[name] for name in types)
        case 'enum':
            return 'one of ' + ', '.join(map(str, limit))
        case 'const':
            return str(limit)
        case 'minimum' | 'exclusiveMinimum':
            return f'{limit:g} or more' if error.validator == 'minimum' else f'above {limit:g}'
        case 'maximum' | 'exclusiveMaximum':
            return f'{limit:g} or less' if error.validator == 'maximum' else f'below {limit:g}'
        case 'minItems' | 'maxItems':
            return f'{limit} items or {"more" if error.validator == "minItems" else "fewer"}'
        case 'uniqueItems':
            return 'a list without repetition'
        case 'pattern':
            return str(error.schema.get('description', f'text like {limit}'))
        case _:
            return f'{error.validator} {limit}'


def _name(path: list[str | int]) -> str:
    """A path as people write it: regions[0].rectangle."""
    text = ''
    for part in path:
        text += f'[{part}]' if isinstance(part, int) else f'.{part}' if text else part
    return text or 'the file'


def _shown(value: Any) -> str:
    """A value as one sees it in the file, shortened."""
    if isinstance(value, dict | list):
        return f'{"a mapping" if isinstance(value, dict) else "a list"} of {len(value)}'
    if value is None:
        return 'nothing'
    if isinstance(value, bool):
        return str(value).lower()
    text = f"'{value}'" if isinstance(value, str) else str(value)
    return text if len(text) <= 40 else text[:37] + '...'

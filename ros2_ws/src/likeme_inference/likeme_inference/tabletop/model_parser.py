"""Parser of model files (format: model_file.py); errors state the line."""

from __future__ import annotations

import csv
import re
import unicodedata
from collections.abc import Iterator, Mapping

from likeme_inference.tabletop.domain import TABLETOP
from likeme_inference.tabletop.finite_domain import Domain
from likeme_inference.tabletop.robot_model import RobotModel, TrialCounts

FORMAT = ['likeme_transition_model', '1']

Line = tuple[int, list[str]]
_END_OF_FILE = ['(end of file)']
#: Counts of up to 15 digits are exact as doubles.
_COUNT = re.compile('[0-9]{1,15}')


class ModelFileError(ValueError):
    """A model file that cannot be used; the message states the line and the reason."""


def parse(text: str) -> RobotModel:
    """Read the text of a model file.

    Raises:
        ModelFileError: with line number and reason.
    """
    lines = _lines(text)
    _take(lines, FORMAT)
    name, version = _value(lines, 'name'), _value(lines, 'version')
    sources, after = _sources(lines)
    domain, after = _domain(after, lines)
    _match(after, header(domain))
    return RobotModel(name, version, sources, tuple(_rows(lines, sources, domain)), domain)


def header(domain: Domain) -> list[str]:
    """The line above the rows."""
    return ['object', 'x_i', 'action', *domain.states, 'source']


def _domain(first: Line, lines: Iterator[Line]) -> tuple[Domain, Line]:
    """Read the domain, and return it with the line after it."""
    states, actions = _listed(first, 'states'), _listed(next(lines), 'actions')
    known = {'state': dict.fromkeys(states), 'action': dict.fromkeys(actions)}
    goals: dict[str, tuple[str, ...]] = {}
    aims: dict[str, str] = {}
    out_of_reach: set[str] = set()
    for number, fields in lines:
        match fields:
            case ['goal', goal, *members] if members and goal and goal not in goals and not aims:
                goals[goal] = _all_known(number, members, 'state', known['state'])
            case ['aim', action, goal] if action not in aims:
                _all_known(number, [action], 'action', known['action'])
                _all_known(number, [goal], 'goal', goals or known['state'])
                aims[action] = goal
            case ['out_of_reach', state]:
                out_of_reach.update(_all_known(number, [state], 'state', known['state']))
            case ['goal' | 'aim' | 'out_of_reach', *_]:
                raise _wrong(
                    number,
                    'expected "goal,NAME,STATE,...", "aim,ACTION,GOAL" or "out_of_reach,STATE", '
                    f'each name once, goals first, got {",".join(fields)!r}',
                )
            case _:
                plain = (states, actions) == (TABLETOP.states, TABLETOP.actions)
                if plain and not (goals or aims or out_of_reach):
                    return TABLETOP, (number, fields)
                return Domain(states, actions, goals, aims, frozenset(out_of_reach)), (
                    number,
                    fields,
                )
    raise AssertionError('The end-of-file line ends the domain.')


def _listed(line: Line, key: str) -> tuple[str, ...]:
    number, fields = line
    names = tuple(fields[1:])
    if fields[0] != key or not names:
        raise _wrong(number, f'expected {key + ",NAME,..."!r}, got {",".join(fields)!r}')
    if not all(names) or len(set(names)) < len(names):
        raise _wrong(number, f'expected {key} with a name each, each once, got {list(names)}')
    return names


def _all_known(
    number: int, names: list[str], what: str, known: Mapping[str, object]
) -> tuple[str, ...]:
    for name in names:
        if name not in known:
            raise _wrong(number, f'expected one of the {what}s {", ".join(known)}, got {name!r}')
    return tuple(names)


def _lines(text: str) -> Iterator[Line]:
    """The lines that are not empty or comments, with their numbers, then an end-of-file line."""
    number = 0
    for number, line in enumerate(text.splitlines(), start=1):
        if line.strip() and not line.lstrip().startswith('#'):
            if any(unicodedata.category(c) == 'Cc' for c in line.strip()):
                raise _wrong(number, f'expected text without control characters, got {line!r}')
            try:
                (fields,) = csv.reader([line], strict=True, skipinitialspace=True)
            except csv.Error as error:
                raise _wrong(number, f'{error}') from error
            yield number, [field.strip() for field in fields]
    yield number + 1, _END_OF_FILE


def _wrong(number: int, reason: str) -> ModelFileError:
    return ModelFileError(f'line {number}: {reason}.')


def _match(line: Line, expected: list[str]) -> None:
    number, fields = line
    if fields is _END_OF_FILE:
        raise _wrong(number, f'expected {",".join(expected)!r}, but the file stops here')
    if fields != expected:
        raise _wrong(number, f'expected {",".join(expected)!r}, got {",".join(fields)!r}')


def _take(lines: Iterator[Line], expected: list[str]) -> None:
    _match(next(lines), expected)


def _value(lines: Iterator[Line], key: str) -> str:
    number, fields = next(lines)
    if len(fields) != 2 or fields[0] != key or not fields[1]:
        raise _wrong(number, f'expected {key + ",..."!r}, got {",".join(fields)!r}')
    return fields[1]


def _sources(lines: Iterator[Line]) -> tuple[dict[str, str], Line]:
    """Read the source lines, and return them with the line after them."""
    sources: dict[str, str] = {}
    for number, fields in lines:
        if fields[0] != 'source' and sources:
            return sources, (number, fields)
        if len(fields) != 3 or fields[0] != 'source' or not all(fields):
            raise _wrong(number, f'expected "source,KEY,SENTENCE", got {",".join(fields)!r}')
        if fields[1] in sources:
            raise _wrong(number, f'expected each source once, got {fields[1]!r} again')
        sources[fields[1]] = fields[2]
    raise AssertionError('The end-of-file line is not a source.')


def _rows(lines: Iterator[Line], sources: dict[str, str], domain: Domain) -> Iterator[TrialCounts]:
    """Read the rows of counts and check the end line."""
    seen: dict[tuple[str, int, int, str], int] = {}
    trials = 0
    places = [{name: i for i, name in enumerate(n)} for n in (domain.states, domain.actions)]
    for number, fields in lines:
        if fields[0] == 'end':
            _match((number, fields), ['end', str(len(seen)), str(trials)])
            break
        row = _row(number, fields, sources, *places)
        first = seen.setdefault((row.object, row.x_i, row.action, row.source), number)
        if first != number:
            raise _wrong(number, f'expected each row once, got that of line {first} again')
        trials += sum(row.counts)
        yield row
    number, fields = next(lines)
    if fields is not _END_OF_FILE:
        raise _wrong(number, f'expected the end of the file, got {",".join(fields)!r}')


def _row(
    number: int,
    fields: list[str],
    sources: Mapping[str, str],
    states: Mapping[str, int],
    actions: Mapping[str, int],
) -> TrialCounts:
    if fields is _END_OF_FILE:
        raise _wrong(number, 'expected a row or "end,ROWS,TRIALS", but the file stops here')
    expected = len(states) + 4
    if len(fields) != expected or not fields[0]:
        raise _wrong(number, f'expected {expected} fields, got {",".join(fields)!r}')
    if fields[-1] not in sources:
        raise _wrong(number, f'expected one of the sources {sorted(sources)}, got {fields[-1]!r}')
    _all_known(number, [fields[1]], 'state', states)
    _all_known(number, [fields[2]], 'action', actions)
    counts = fields[3:-1]
    if not all(_COUNT.fullmatch(count) for count in counts):
        raise _wrong(number, f'expected whole counts of 0 or more, got {",".join(counts)!r}')
    ends = tuple(map(int, counts))
    return TrialCounts(fields[0], states[fields[1]], actions[fields[2]], ends, fields[-1])

"""Model files: trial counts as text that people read and edit, format 1.

Comma-separated lines, `#` comments and empty lines anywhere, in this order:

    likeme_transition_model,1           format and its version
    name,chung2015_robot                name and version of the model
    version,1
    source,paper,"Where, by whom, ..."  one line a source: key, sentence; at least one
    states,LEFT,RIGHT,OFFTABLE
    actions,PLACE_LEFT,...              names in the order of their numbers
    goal,TIDY,LEFT,RIGHT                a goal and its states; without any, each state is a goal
    aim,PLACE_LEFT,LEFT                 the goal an action is meant for, if any; decides ties
    out_of_reach,OFFTABLE               a state the robot cannot take an object from
    object,x_i,action,LEFT,RIGHT,OFFTABLE,source
    pear,LEFT,PLACE_LEFT,10,0,0,paper   how often x_f was LEFT, RIGHT, OFFTABLE, by that source
    ...
    end,54,540                          rows and trials above: a torn file has no such line

Lines of goal, aim and out_of_reach are left out for the tabletop, which knows its own
(domain.TABLETOP). Rows that are missing were never tried. The same row may come from several
sources: counts add up. Names are words of one line, without spaces around them; an object is not
called `end`, nor does its name begin with `#`.
"""

from __future__ import annotations

import csv
import io
import re
import unicodedata
from collections.abc import Iterator, Mapping
from importlib import resources
from pathlib import Path

from likeme_inference.tabletop.domain import TABLETOP
from likeme_inference.tabletop.robot_model import RobotModel, TrialCounts
from likeme_inference.tabletop.spaces import Domain

FORMAT = ['likeme_transition_model', '1']

Line = tuple[int, list[str]]
_END_OF_FILE = ['(end of file)']
#: Digits of a count: with more, not every whole number is a double.
_COUNT = re.compile('[0-9]{1,15}')


class ModelFileError(ValueError):
    """A model file that cannot be used: which line, and why."""


def shipped() -> RobotModel:
    """Read the default model: the 540 trials of the paper's own robot."""
    data = resources.files('likeme_inference').joinpath('data', 'chung2015_robot.csv')
    return parse(data.read_text(encoding='utf-8'))


def load(path: str | Path) -> RobotModel:
    """Read a model file.

    Raises:
        ModelFileError: with file, line number and reason.
    """
    path = Path(path)
    try:
        return parse(path.read_text(encoding='utf-8-sig'))
    except OSError as error:
        raise ModelFileError(f'{path}: {error.strerror}.') from error
    except UnicodeDecodeError as error:
        raise ModelFileError(
            f'{path}: expected UTF-8 text, got byte {error.start} wrong.'
        ) from error
    except ModelFileError as error:
        raise ModelFileError(f'{path}: {error}') from error


def load_tabletop(path: str | Path) -> RobotModel:
    """Read a model of the paper's table, for what works there alone.

    Raises:
        ModelFileError: as `load`; or the states, actions, goals, aims or reach are others; or it
            knows no object.
    """
    model = load(path)
    ours, theirs = TABLETOP, model.domain
    if (theirs.states, theirs.actions) != (ours.states, ours.actions):
        raise ModelFileError(
            f'{path}: expected the states {", ".join(ours.states)} and the actions '
            f'{", ".join(ours.actions)}, got {", ".join(theirs.states)} and '
            f'{", ".join(theirs.actions)}.'
        )
    if theirs != ours:
        raise ModelFileError(
            f'{path}: expected no lines goal, aim and out_of_reach but those of the tabletop, '
            'which may be left out, got others.'
        )
    if not model.objects:
        raise ModelFileError(f'{path}: expected rows of at least one object, got none.')
    return model


def save(model: RobotModel, path: str | Path) -> None:
    """Write a model file whole or not at all: a reader never sees half of it.

    Raises:
        ModelFileError: see `format_model`.
    """
    text, path = format_model(model), Path(path)
    part = path.with_name(path.name + '.part')
    try:
        part.write_text(text, encoding='utf-8')
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)


def format_model(model: RobotModel) -> str:
    """Write a model as the text of its file; `parse` gives it back.

    Raises:
        ModelFileError: a name that the format cannot hold, or no source.
    """
    text = io.StringIO()
    out = csv.writer(text, lineterminator='\n')
    out.writerows([FORMAT, ['name', model.name], ['version', model.version]])
    out.writerows(['source', key, sentence] for key, sentence in model.sources.items())
    domain = model.domain
    out.writerows([['states', *domain.states], ['actions', *domain.actions]])
    if domain != TABLETOP:
        out.writerows(['goal', name, *states] for name, states in domain.goals.items())
        out.writerows(['aim', *aim] for aim in domain.aims.items())
        out.writerows(['out_of_reach', state] for state in sorted(domain.out_of_reach))
    out.writerow(_header(domain))
    out.writerows(
        [row.object, domain.states[row.x_i], domain.actions[row.action], *row.counts, row.source]
        for row in model.rows
    )
    out.writerow(['end', len(model.rows), sum(sum(row.counts) for row in model.rows)])
    _check_whole(model, text.getvalue())
    return text.getvalue()


def _check_whole(model: RobotModel, text: str) -> None:
    """Whatever a name does to the format, what is written is what will be read."""
    try:
        text.encode('utf-8')
        same = parse(text) == model
    except ValueError:
        same = False
    if not same:
        raise ModelFileError(
            f'A file cannot hold {model.label!r}: expected a source, and names of one line '
            'without spaces around them, no object called "end" or with a # in front; got the '
            f'sources {list(model.sources)} and the objects {list(model.objects)}.'
        )


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
    _match(after, _header(domain))
    return RobotModel(name, version, sources, tuple(_rows(lines, sources, domain)), domain)


def _header(domain: Domain) -> list[str]:
    return ['object', 'x_i', 'action', *domain.states, 'source']


def _domain(first: Line, lines: Iterator[Line]) -> tuple[Domain, Line]:
    """Read what the rows are about, and the line after it."""
    states, actions = _listed(first, 'states'), _listed(next(lines), 'actions')
    known = {'state': dict.fromkeys(states), 'action': dict.fromkeys(actions)}
    goals: dict[str, tuple[str, ...]] = {}
    aims: dict[str, str] = {}
    stuck: set[str] = set()
    for number, fields in lines:
        match fields:
            case ['goal', goal, *members] if members and goal and goal not in goals and not aims:
                goals[goal] = _all_known(number, members, 'state', known['state'])
            case ['aim', action, goal] if action not in aims:
                _all_known(number, [action], 'action', known['action'])
                _all_known(number, [goal], 'goal', goals or known['state'])
                aims[action] = goal
            case ['out_of_reach', state]:
                stuck.update(_all_known(number, [state], 'state', known['state']))
            case ['goal' | 'aim' | 'out_of_reach', *_]:
                raise _wrong(
                    number,
                    'expected "goal,NAME,STATE,...", "aim,ACTION,GOAL" or "out_of_reach,STATE", '
                    f'each name once, goals first, got {",".join(fields)!r}',
                )
            case _:
                plain = (states, actions) == (TABLETOP.states, TABLETOP.actions)
                if plain and not (goals or aims or stuck):
                    return TABLETOP, (number, fields)
                return Domain(states, actions, goals, aims, frozenset(stuck)), (number, fields)
    raise AssertionError('The line that says the file ends ends the domain.')


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
    """Give the lines that say something with their numbers, at last one for the file's end."""
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
    """Read all source lines and the line after them."""
    sources: dict[str, str] = {}
    for number, fields in lines:
        if fields[0] != 'source' and sources:
            return sources, (number, fields)
        if len(fields) != 3 or fields[0] != 'source' or not all(fields):
            raise _wrong(number, f'expected "source,KEY,SENTENCE", got {",".join(fields)!r}')
        if fields[1] in sources:
            raise _wrong(number, f'expected each source once, got {fields[1]!r} again')
        sources[fields[1]] = fields[2]
    raise AssertionError('The line that says the file ends is no source.')


def _rows(lines: Iterator[Line], sources: dict[str, str], domain: Domain) -> Iterator[TrialCounts]:
    """Read all rows of counts; the end line must agree with them, and nothing may follow it."""
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

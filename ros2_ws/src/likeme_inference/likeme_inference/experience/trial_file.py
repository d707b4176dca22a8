"""Trial files: trials as text, format 1.

Comma-separated lines, `#` comments and empty lines anywhere, in this order:

    likeme_experience,1                 format and its version
    robot,campaign,object,x_i,action,repetition,x_f,motion,seed,version,time,before_x,before_y,...
    sim-1,offline-1,pear,LEFT,PUSH_RIGHT,0,RIGHT,COMPLETED,77,0.1.0,1760000000000000000,0.44,...
    ...
    end,1                               trials above; detects truncated files

States and actions by their names in the world file, motions by those in likeme_core; time in ns
since the epoch; places in m and rad, base_link, empty if the object was not visible. Robot,
campaign, pair and repetition are the key of the trial: importing it again changes nothing.
"""

from __future__ import annotations

import csv
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TextIO, TypeVar

from likeme_core.outcomes import MotionOutcome
from likeme_core.tabletop import Action, State
from likeme_core.world import World
from likeme_inference.experience.schema import row_of
from likeme_inference.experience.trial import Pair, Place, Trial, TrialKey

Name = TypeVar('Name', State, Action, MotionOutcome)
FORMAT = ['likeme_experience', '1']
PLACES = [f'{when}_{what}' for when in ('before', 'after') for what in Place._fields]
HEADER = [
    'robot', 'campaign', 'object', 'x_i', 'action', 'repetition', 'x_f', 'motion', 'seed',
    'version', 'time', *PLACES,
]  # fmt: skip


class TrialFileError(ValueError):
    """A trial file that cannot be used; the message states the line and the reason."""


def save(trials: Iterable[Trial], path: Path) -> int:
    """Write a trial file atomically; returns the number of trials."""
    part = path.with_name(path.name + '.part')
    with part.open('w', encoding='utf-8', newline='') as text:
        count = write(trials, text)
    part.replace(path)
    return count


def write(trials: Iterable[Trial], text: TextIO) -> int:
    """Write trials as text; returns their number."""
    out, count = csv.writer(text, lineterminator='\n'), 0
    out.writerows([FORMAT, HEADER])
    for count, trial in enumerate(trials, start=1):  # noqa: B007
        out.writerow(_fields(trial))
    out.writerow(['end', count])
    return count


def _fields(trial: Trial) -> list[object]:
    row = row_of(trial)
    pair = trial.key.pair
    names: dict[str, State | Action | MotionOutcome] = {
        'x_i': pair.x_i,
        'action': pair.action,
        'x_f': trial.x_f,
        'motion': trial.motion,
    }
    row |= {key: value.name for key, value in names.items()}
    return ['' if row[name] is None else row[name] for name in HEADER]


def load(path: Path, world: World) -> tuple[Trial, ...]:
    """Read a whole trial file of a world.

    Raises:
        TrialFileError: with file, line number and reason.
    """
    try:
        return tuple(parse(path.read_text(encoding='utf-8').splitlines(), world))
    except OSError as error:
        raise TrialFileError(f'{path}: {error.strerror}.') from error
    except UnicodeDecodeError as error:
        raise TrialFileError(
            f'{path}: expected UTF-8 text, got byte {error.start} wrong.'
        ) from error
    except TrialFileError as error:
        raise TrialFileError(f'{path}: {error}') from error


def parse(text: Iterable[str], world: World) -> Iterator[Trial]:
    """Read the lines of a trial file.

    Raises:
        TrialFileError: with line number and reason.
    """
    lines = _lines(text)
    for expected in (FORMAT, HEADER):
        _match(next(lines), expected)
    for count, (number, fields) in enumerate(lines):
        if fields[0] == 'end':
            _match((number, fields), ['end', str(count)])
            break
        yield _trial(number, fields, world)
    _match(next(lines, (0, ['(end of file)'])), ['(end of file)'])


def _lines(text: Iterable[str]) -> Iterator[tuple[int, list[str]]]:
    """The lines that are not empty or comments, with their numbers, then an end-of-file line."""
    number = 0
    for number, line in enumerate(text, start=1):
        if line.strip() and not line.lstrip().startswith('#'):
            yield number, next(csv.reader([line]))
    yield number + 1, ['(end of file)']


def _match(line: tuple[int, list[str]], expected: list[str]) -> None:
    number, fields = line
    if fields != expected:
        raise TrialFileError(
            f'line {number}: expected {",".join(expected)!r}, got {",".join(fields)!r}.'
        )


def _trial(number: int, fields: list[str], world: World) -> Trial:
    if fields == ['(end of file)']:
        raise TrialFileError(f'line {number}: expected a trial or "end", but the file stops here.')
    if len(fields) != len(HEADER):
        raise TrialFileError(f'line {number}: expected {len(HEADER)} fields, got {len(fields)}.')
    row = dict(zip(HEADER, fields, strict=True))
    try:
        pair = Pair(
            row['object'], _named(world.states, row['x_i']), _named(world.actions, row['action'])
        )
        key = TrialKey(row['robot'], row['campaign'], pair, int(row['repetition']))
        return Trial(
            key, _named(world.states, row['x_f']),
            _named(tuple(MotionOutcome), row['motion']), int(row['seed']),
            row['version'], int(row['time']), _place(row, 'before'), _place(row, 'after'),
        )  # fmt: skip
    except ValueError as error:
        raise TrialFileError(f'line {number}: {error}') from error


def _named(known: tuple[Name, ...], name: str) -> Name:
    found = {member.name: member for member in known}
    if name not in found:
        raise ValueError(f'expected one of {" ".join(found)}, got {name!r}.')
    return found[name]


def _place(row: dict[str, str], when: str) -> Place | None:
    values = [row[f'{when}_{name}'] for name in Place._fields]
    return Place(*map(float, values)) if all(values) else None

"""Writes type stubs (.pyi) of this package's interfaces, read from their definitions.

write_stubs.py PACKAGE_FOLDER OUTPUT_FOLDER

Run by CMake at build; rosidl generates no type information of its own. Fields and constants keep
their order, constructors take keywords only, as the generated classes do.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

from rosidl_adapter.parser import parse_action_file, parse_message_file, parse_service_file

PACKAGE = 'likeme_msgs'
INTEGERS = {f'{sign}int{bits}' for sign in ('', 'u') for bits in (8, 16, 32, 64)}
SCALARS = dict.fromkeys(INTEGERS, 'int') | {
    'bool': 'bool',
    'byte': 'bytes',
    'char': 'int',
    'float32': 'float',
    'float64': 'float',
    'string': 'str',
    'wstring': 'str',
}


def annotation(kind: Any) -> str:
    """The Python type of a field; sequences may be set from any sequence."""
    name = SCALARS.get(kind.type) or f'{kind.pkg_name}.msg.{kind.type}'
    return f'Sequence[{name}]' if kind.is_array else name


def class_lines(message: Any, name: str, indent: str = '') -> Iterator[str]:
    """The stub of one message class."""
    fields = [(field.name, annotation(field.type)) for field in message.fields]
    yield f'{indent}class {name}:'
    for constant in message.constants:
        yield f'{indent}    {constant.name}: ClassVar[{SCALARS[constant.type]}]'
    for field, kind in fields:
        yield f'{indent}    {field}: {kind}'
    if fields:
        yield (
            f'{indent}    def __init__(self, *, '
            + ', '.join(f'{field}: {kind} = ...' for field, kind in fields)
            + ') -> None: ...'
        )
    else:
        yield f'{indent}    def __init__(self) -> None: ...'
    yield f'{indent}    @classmethod'
    yield f'{indent}    def get_fields_and_field_types(cls) -> dict[str, str]: ...'


def service_lines(service: Any, name: str) -> Iterator[str]:
    """The stub of one service class."""
    yield f'class {name}:'
    yield from class_lines(service.request, 'Request', '    ')
    yield from class_lines(service.response, 'Response', '    ')


def action_lines(action: Any, name: str) -> Iterator[str]:
    """The stub of one action class."""
    yield f'class {name}:'
    yield from class_lines(action.goal, 'Goal', '    ')
    yield from class_lines(action.result, 'Result', '    ')
    yield from class_lines(action.feedback, 'Feedback', '    ')


def module(imports: Iterable[str], bodies: Sequence[Iterator[str]]) -> str:
    """The text of one stub module."""
    lines = ['from collections.abc import Sequence', 'from typing import ClassVar', '']
    lines += [f'import {name}.msg' for name in sorted(set(imports))]
    for body in bodies:
        lines += ['', *body]
    return '\n'.join(lines) + '\n'


def packages_of(messages: Iterable[Any]) -> set[str]:
    """Packages whose messages are fields of these."""
    return {f.type.pkg_name for m in messages for f in m.fields if f.type.pkg_name}


def main() -> None:
    """Write OUTPUT_FOLDER/{msg,srv,action}/__init__.pyi and py.typed."""
    source, out = Path(sys.argv[1]), Path(sys.argv[2])
    messages = {p.stem: parse_message_file(PACKAGE, p) for p in sorted(source.glob('msg/*.msg'))}
    services = {p.stem: parse_service_file(PACKAGE, p) for p in sorted(source.glob('srv/*.srv'))}
    actions = {
        p.stem: parse_action_file(PACKAGE, p) for p in sorted(source.glob('action/*.action'))
    }
    parts = [part for a in actions.values() for part in (a.goal, a.result, a.feedback)]
    sides = [side for s in services.values() for side in (s.request, s.response)]
    texts = {
        'msg': module(
            packages_of(messages.values()), [class_lines(m, n) for n, m in messages.items()]
        ),
        'srv': module(packages_of(sides), [service_lines(s, n) for n, s in services.items()]),
        'action': module(packages_of(parts), [action_lines(a, n) for n, a in actions.items()]),
    }
    for folder, text in texts.items():
        (out / folder).mkdir(parents=True, exist_ok=True)
        (out / folder / '__init__.pyi').write_text(text, encoding='utf-8')
    (out / 'py.typed').write_text('', encoding='utf-8')


if __name__ == '__main__':
    main()

"""Changes of a world file that keep the rest of its text, comments included."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from likeme_core.world.file import parse_world
from likeme_core.world.folder import WORLDS_FOLDER
from likeme_core.world.values import World


class _Edit(NamedTuple):
    """Replaces the text between two positions."""

    start: int
    end: int
    text: str


def with_values(text: str, section: str, values: Mapping[str, Any]) -> str:
    """The text with some values of a section (camera, table) replaced or added.

    Raises:
        ValueError: it has no such section.
    """
    found = _value(_root(text), section)
    if not isinstance(found, yaml.MappingNode) or not found.value:
        raise ValueError(f'Expected the section {section} in the world file, got none.')
    there = {key.value: value for key, value in found.value}
    edits = [
        _Edit(there[name].start_mark.index, _end(there[name]), _flow(value))
        for name, value in values.items()
        if name in there
    ]
    joint = ', ' if found.flow_style else '\n' + ' ' * found.start_mark.column
    new = ''.join(
        f'{joint}{name}: {_flow(value)}' for name, value in values.items() if name not in there
    )
    last = max(_end(value) for value in there.values())
    return _edited(text, [*edits, _Edit(last, last, new)])


def with_object(text: str, entry: Mapping[str, Any]) -> str:
    """The text with an entry of `objects` added, or replaced if it has one of that name.

    Raises:
        ValueError: its objects are not lines that start with a dash.
    """
    objects = _value(_root(text), 'objects')
    if not isinstance(objects, yaml.SequenceNode) or objects.flow_style:
        raise ValueError("Expected objects in the world file as lines that start with '- '.")
    lines = yaml.safe_dump([dict(entry)], sort_keys=False, default_flow_style=None, width=98)
    indented = lines.rstrip().replace('\n', '\n' + ' ' * objects.start_mark.column)
    for item in objects.value:
        if _value(item, 'name').value == entry['name']:
            return _edited(text, [_Edit(item.start_mark.index, _end(item), indented[2:])])
    last = _end(objects.value[-1])
    return _edited(text, [_Edit(last, last, f'\n{" " * objects.start_mark.column}{indented}')])


def check_own_file(path: Path) -> None:
    """Refuse to change the worlds that come with LikeMe.

    Raises:
        ValueError: it is one of them, or no file.
    """
    if not path.is_file():
        raise ValueError(f'Expected a world file of yours, got {path}: `world.sh new` starts one.')
    if path.resolve().parent == WORLDS_FOLDER.resolve():
        raise ValueError(
            f'Expected a world file of yours, got {path.name}, which comes with LikeMe: '
            '`world.sh new` starts one.'
        )


def write_world(path: Path, text: str) -> World:
    """Replace a world file; the new world. It is checked first, and never half written.

    Raises:
        WorldFileError: the text is not a valid world.
        OSError: the file cannot be written.
    """
    world = parse_world(text, path)
    # Through links: they stay.
    file = path.resolve()
    new = file.with_name(f'{file.name}.new')
    new.write_text(text, encoding='utf-8')
    os.replace(new, file)
    return world


def _root(text: str) -> Any:
    return yaml.compose(text, Loader=yaml.SafeLoader)


def _value(node: Any, name: str) -> Any:
    """The node of a key's value; None: there is none."""
    for key, value in node.value:
        if key.value == name:
            return value
    return None


def _end(node: Any) -> int:
    """Where a value ends in the text; PyYAML has block values end where the next one begins."""
    if isinstance(node, yaml.ScalarNode) or node.flow_style or not node.value:
        return int(node.end_mark.index)
    last = node.value[-1]
    return _end(last[1] if isinstance(node, yaml.MappingNode) else last)


def _flow(value: Any) -> str:
    """A value on one line."""
    return yaml.safe_dump(value, default_flow_style=True, width=10**6).split('\n')[0]


def _edited(text: str, edits: list[_Edit]) -> str:
    for start, end, new in sorted(edits, reverse=True):
        text = text[:start] + new + text[end:]
    return text

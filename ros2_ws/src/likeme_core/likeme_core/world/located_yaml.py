"""YAML data together with the line of each of its values."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, NamedTuple

import yaml

_Loader: Any = getattr(yaml, 'CSafeLoader', yaml.SafeLoader)

Path = tuple[str | int, ...]


class Problem(NamedTuple):
    """What is wrong in a file: line (from 1), and expected and got in one sentence."""

    line: int
    message: str


@dataclass
class LocatedYaml:
    """A YAML document: its data, and the line of each value by its path in the data."""

    data: Any
    lines: dict[Path, int] = field(default_factory=dict)
    problems: list[Problem] = field(default_factory=list)

    def line(self, path: Sequence[str | int]) -> int:
        """The line of a value, or of the nearest value around it."""
        for length in range(len(path), -1, -1):
            if (found := self.lines.get(tuple(path[:length]))) is not None:
                return found
        return 1


class _Yaml12Loader(_Loader):  # type: ignore[misc]
    """Reads scalars as YAML 1.2: OFF, no and y are names, 1e-3 is a number."""

    yaml_implicit_resolvers: ClassVar[dict[str, list[Any]]] = {
        first: [
            (tag, pattern) for tag, pattern in resolvers if not tag.endswith((':bool', ':float'))
        ]
        for first, resolvers in _Loader.yaml_implicit_resolvers.items()
    }


_Yaml12Loader.add_implicit_resolver(
    'tag:yaml.org,2002:bool', re.compile('^(true|True|TRUE|false|False|FALSE)$'), list('tTfF')
)
_Yaml12Loader.add_implicit_resolver(
    'tag:yaml.org,2002:float',
    re.compile(
        r'^([-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?'
        r'|[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN))$'
    ),
    list('-+.0123456789'),
)


def read_located(text: str) -> LocatedYaml:
    """Parse a YAML text; what is no single valid document is among its problems."""
    try:
        loader = _Yaml12Loader(text)
        node = loader.get_single_node()
        data = None if node is None else loader.construct_document(node)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        reason = ' '.join(part for part in (error.context, error.problem) if part)
        line = 1 if mark is None else mark.line + 1
        return LocatedYaml(None, problems=[Problem(line, f'Expected YAML, got: {reason}.')])
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        reason = ' '.join(str(error).split())
        return LocatedYaml(None, problems=[Problem(1, f'Expected YAML, got: {reason}.')])
    if node is None:
        return LocatedYaml(None, problems=[Problem(1, 'Expected a world, got an empty file.')])
    located = LocatedYaml(data)
    located.problems.extend(_locate(node, (), located.lines))
    return located


def _locate(node: yaml.Node, path: Path, lines: dict[Path, int]) -> Iterator[Problem]:
    """Note the line of every value; yields keys that appear twice and values by reference."""
    if path in lines or len(path) > 20:
        yield Problem(node.start_mark.line + 1, 'Expected values, got an alias within itself.')
        return
    lines[path] = node.start_mark.line + 1
    if isinstance(node, yaml.MappingNode):
        seen = set()
        for key, value in node.value:
            line = key.start_mark.line + 1
            name = str(key.value) if isinstance(key, yaml.ScalarNode) else '?'
            if name in seen:
                yield Problem(line, f"Expected each key once, got '{name}' again.")
                continue
            seen.add(name)
            yield from _locate(value, (*path, name), lines)
            # A key is where one looks for its value.
            lines[(*path, name)] = line
    elif isinstance(node, yaml.SequenceNode):
        for index, item in enumerate(node.value):
            yield from _locate(item, (*path, index), lines)

"""Reading of world files (YAML, format 1), with the line, expected and got of each error.

`world.schema.json` in the folder `worlds` describes the format, for editors and for this module.
What a schema cannot say (names that must exist, areas that must not overlap) is in `checks.py`.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

from likeme_core.world.build import build_world
from likeme_core.world.checks import problems_of
from likeme_core.world.folder import WORLDS_FOLDER
from likeme_core.world.located_yaml import LocatedYaml, Problem, read_located
from likeme_core.world.schema_problems import schema_problems
from likeme_core.world.values import World

#: The world that the paper's numbers are from.
DEFAULT_WORLD = 'chung2015'


class WorldFileError(ValueError):
    """A world file cannot be used; the message tells the first problem.

    Attributes:
        problems: all of them, in the order of their lines.
    """

    def __init__(self, path: Path | str, problems: list[Problem]) -> None:
        self.problems = sorted(problems)
        line, message = self.problems[0]
        more = f' {len(problems) - 1} more: see world.sh check.' if len(problems) > 1 else ''
        super().__init__(f'{path}:{line}: {message}{more}')


def shipped_worlds() -> tuple[str, ...]:
    """The names of the worlds that come with LikeMe."""
    return tuple(sorted(path.stem for path in WORLDS_FOLDER.glob('*.yaml')))


def world_path(name_or_path: str) -> Path:
    """The file of a shipped world's name, or the path itself.

    Raises:
        ValueError: neither.
    """
    if name_or_path in shipped_worlds():
        return WORLDS_FOLDER / f'{name_or_path}.yaml'
    path = Path(name_or_path).expanduser()
    if not path.is_file():
        names = ', '.join(shipped_worlds())
        raise ValueError(
            f"Expected a world's name ({names}) or the path of a world file, got '{name_or_path}'."
        )
    return path.resolve()


def load_world(name_or_path: str = DEFAULT_WORLD) -> World:
    """Read a shipped world by its name, or a world file by its path.

    Raises:
        WorldFileError: the file is not a valid world.
        ValueError: no such world.
    """
    return _read(world_path(name_or_path))


def load_world_anew(name_or_path: str) -> World:
    """As load_world, from the file as it is now; load_world keeps what it has read.

    Raises:
        WorldFileError: the file is not a valid world.
        ValueError: no such world.
    """
    _read.cache_clear()
    return load_world(name_or_path)


@cache
def _read(path: Path) -> World:
    try:
        text = path.read_text(encoding='utf-8')
    except (OSError, UnicodeDecodeError) as error:
        raise WorldFileError(
            path, [Problem(1, f'Expected text in UTF-8, got: {error}.')]
        ) from None
    return parse_world(text, path)


def parse_world(text: str, path: Path) -> World:
    """The world that a text describes; path: named in errors, and where meshes are looked for.

    Raises:
        WorldFileError: it is not a valid world.
    """
    located = read_located(text)
    problems = located.problems or _problems(located, path.parent)
    if problems:
        raise WorldFileError(path, problems)
    return build_world(located.data, path)


def _problems(located: LocatedYaml, folder: Path) -> list[Problem]:
    """Problems of the structure; without any, those of the content."""
    return schema_problems(located) or problems_of(located, folder)

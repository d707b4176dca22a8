"""Where URDFs and their meshes are: installed packages of ROS, and those of pip."""

from __future__ import annotations

import site
from contextlib import suppress
from pathlib import Path

from ament_index_python.packages import PackageNotFoundError, get_package_share_directory

PACKAGE = 'package://'


def urdf_path(source: str) -> Path:
    """The file of a path or package://NAME/PATH.

    Raises:
        ValueError: there is no such file.
    """
    if not source.startswith(PACKAGE):
        path = Path(source)
    else:
        name, _, rest = source.removeprefix(PACKAGE).partition('/')
        path = next((p for p in (f / name / rest for f in _shares(name)) if p.is_file()), Path())
    if not path.is_file():
        hint = (
            ' (scripts/start_cell.sh --arm installs it, or `pip install example-robot-data`)'
            if 'example-robot-data' in source
            else ''
        )
        raise ValueError(f'Expected a URDF at {source}, found none{hint}.')
    return path


def package_folders(urdf: Path) -> list[str]:
    """Folders in which the packages of a URDF's meshes may be."""
    parents = [str(folder) for folder in urdf.parents if len(folder.parts) > 2]
    return [*parents, *map(str, _shares(''))]


def _shares(name: str) -> list[Path]:
    """Folders with packages in them: that of a ROS package, and those of the cmeel wheels."""
    found = [Path(folder, 'cmeel.prefix', 'share') for folder in site.getsitepackages()]
    if name:
        with suppress(PackageNotFoundError):
            found.insert(0, Path(get_package_share_directory(name)).parent)
    return found

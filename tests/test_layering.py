"""Which package may import which, and which files may import ROS."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from collections.abc import Iterator
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

SOURCES = Path(__file__).parents[1] / 'ros2_ws' / 'src'
#: Our packages that each package may import; the table of docs/architecture.md.
MAY_IMPORT: dict[str, set[str]] = {
    'likeme_core': set(),
    'likeme_perception': {'likeme_core'},
    'likeme_inference': {'likeme_core'},
    'likeme_gaze': {'likeme_core'},
    'likeme_arm': {'likeme_core'},
    'likeme_arm_sim': {'likeme_core', 'likeme_arm'},
    'likeme_bags': set(),
    'likeme_replay': {'likeme_core', 'likeme_perception', 'likeme_inference', 'likeme_bags'},
    'likeme_experiments': {
        'likeme_core', 'likeme_perception', 'likeme_inference', 'likeme_gaze', 'likeme_arm',
        'likeme_arm_sim',
    },
    'likeme_bringup': {
        'likeme_core', 'likeme_perception', 'likeme_inference', 'likeme_gaze', 'likeme_arm_sim',
    },
    'likeme_operator': {'likeme_core', 'likeme_inference', 'likeme_arm', 'likeme_bringup'},
}  # fmt: skip
PACKAGES = tuple(MAY_IMPORT)
MODULES = sorted(
    path for package in PACKAGES for path in (SOURCES / package / package).rglob('*.py')
)
ROS = {'rclpy', 'rosgraph_msgs', 'std_srvs', 'builtin_interfaces', 'rcl_interfaces', 'tf2_ros'}


def imported(path: Path) -> Iterator[str]:
    """Modules that a file imports, wherever in it, by their full names."""
    for node in ast.walk(ast.parse(path.read_text(encoding='utf-8'), path)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            yield node.module
            yield from (f'{node.module}.{alias.name}' for alias in node.names)


def packages_of(path: Path) -> set[str]:
    return {name.partition('.')[0] for name in imported(path)}


def may_import_ros(path: Path) -> bool:
    in_ros = 'ros' in path.relative_to(SOURCES).parts
    return in_ros or path.name.endswith('_node.py') or path.name == 'messages.py'


def name_of(path: Path) -> str:
    return str(path.relative_to(SOURCES))


def test_every_package_is_in_the_table() -> None:
    there = {path.name for path in SOURCES.iterdir() if (path / path.name).is_dir()}
    assert there == set(PACKAGES)


def test_the_table_is_that_of_the_architecture() -> None:
    text = (SOURCES.parents[1] / 'docs' / 'architecture.md').read_text(encoding='utf-8')
    rows = re.findall(r'^\| `(likeme_\w+)` \|.*\|([^|]*)\|$', text, re.M)
    written = {
        name: {f'likeme_{w.strip()}' for w in may.split(',') if w.strip()} for name, may in rows
    }
    assert written.pop('likeme_msgs') == set()
    assert written == MAY_IMPORT


@pytest.mark.parametrize('package', PACKAGES)
def test_a_package_imports_only_what_the_table_permits(package: str) -> None:
    permitted = MAY_IMPORT[package] | {package, 'likeme_msgs'}
    for path in (SOURCES / package / package).rglob('*.py'):
        others = {name for name in packages_of(path) if name.startswith('likeme_')}
        assert others <= permitted, f'{name_of(path)} imports {sorted(others - permitted)}.'


@pytest.mark.parametrize('path', [p for p in MODULES if not may_import_ros(p)], ids=name_of)
def test_only_ros_folders_nodes_and_messages_import_ros(path: Path) -> None:
    used = {name for name in packages_of(path) if name in ROS or name.endswith('_msgs')}
    assert not used, f'{name_of(path)} imports {used}; ros/, *_node.py and messages.py may.'


@pytest.mark.parametrize('path', [p for p in MODULES if p.name.endswith('_node.py')], ids=name_of)
def test_a_node_file_holds_a_node(path: Path) -> None:
    classes = [n for n in ast.parse(path.read_text('utf-8')).body if isinstance(n, ast.ClassDef)]
    bases = {ast.unparse(base) for each in classes for base in each.bases}
    assert any(base.endswith('Node') for base in bases), f'{name_of(path)} holds no Node.'


def test_no_modules_import_each_other_in_a_circle() -> None:
    module_of = {
        '.'.join(path.relative_to(SOURCES).with_suffix('').parts[1:]).removesuffix(
            '.__init__'
        ): path
        for path in MODULES
    }
    packages = {name.rpartition('.')[0] for name in module_of}
    graph = {
        # `from package import module` is an import of the module.
        name: {n for n in imported(path) if n in module_of and n not in packages and n != name}
        for name, path in module_of.items()
    }
    # Raises CycleError, which names the circle.
    assert len(list(TopologicalSorter(graph).static_order())) == len(module_of)


def test_consoles_are_apps_that_every_typer_reads() -> None:
    """Others fail at X | None with the Typer of Ubuntu 24.04; likeme_bags does without."""
    plain = {
        name_of(path) for path in MODULES if 'typer.Typer(' in path.read_text(encoding='utf-8')
    }
    assert plain == {'likeme_bags/likeme_bags/bag_console.py'}
    text = (SOURCES / 'likeme_bags' / 'likeme_bags' / 'bag_console.py').read_text('utf-8')
    assert not re.search(r'Annotated\[\s*[\w\[\]]+ \| None', text)
    assert '__future__' not in text


def test_what_starts_often_leaves_heavy_libraries_to_those_who_use_them() -> None:
    """Each takes 0.1 to 0.3 s of every start; scipy, sqlalchemy and matplotlib are used late."""
    modules = (
        'likeme_bringup.demo, likeme_inference.inference_node, '
        'likeme_operator.ros.operator_commands'
    )
    code = (
        f'import sys, {modules}; print({{"matplotlib", "scipy", "sqlalchemy"}} & {{*sys.modules}})'
    )
    command = [sys.executable, '-c', code]
    told = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
    assert told.stdout == 'set()\n'

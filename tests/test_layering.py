"""Thinking needs no ROS, and the three thinking packages do not know one another."""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

SOURCES = Path(__file__).parents[1] / 'ros2_ws' / 'src'
THINKING = ('likeme_arm_sim', 'likeme_inference', 'likeme_perception')
PACKAGES = (*THINKING, 'likeme_bags', 'likeme_bringup')
MODULES = sorted(
    path for package in PACKAGES for path in (SOURCES / package / package).rglob('*.py')
)
ROS = {'rclpy', 'rosgraph_msgs', 'std_srvs', 'builtin_interfaces', 'rcl_interfaces', 'tf2_ros'}


def imported(path: Path) -> Iterator[str]:
    """Top-level names a module imports, wherever in it."""
    for node in ast.walk(ast.parse(path.read_text(encoding='utf-8'), path)):
        if isinstance(node, ast.Import):
            yield from (alias.name.partition('.')[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            yield node.module.partition('.')[0]


def may_speak_ros(path: Path) -> bool:
    return path.name.endswith('_node.py') or path.name == 'messages.py'


def name_of(path: Path) -> str:
    return str(path.relative_to(SOURCES))


def test_there_is_something_to_scan() -> None:
    assert {path.relative_to(SOURCES).parts[0] for path in MODULES} == set(PACKAGES)


@pytest.mark.parametrize('path', [p for p in MODULES if not may_speak_ros(p)], ids=name_of)
def test_only_nodes_and_messages_import_ros(path: Path) -> None:
    spoken = {name for name in imported(path) if name in ROS or name.endswith('_msgs')}
    assert not spoken, f'{name_of(path)} imports {spoken}; only *_node.py and messages.py may.'


@pytest.mark.parametrize('package', THINKING)
def test_the_thinking_packages_do_not_import_one_another(package: str) -> None:
    others = {*PACKAGES} - {package}
    for path in (SOURCES / package / package).rglob('*.py'):
        known = others.intersection(imported(path))
        assert not known, f'{name_of(path)} imports {known}.'


#: With ROS 2, or with another package that is named.
COME_WITH_OTHERS = {'ament_index_python', 'domain_coordinator', 'pybullet_data', 'pybullet_utils'}
#: What is imported: its key in rosdep (None: it has none), its name for pip.
KEYS = {
    'backports': (None, 'backports.zstd'),
    'cv2': ('python3-opencv', 'opencv-python-headless'),
    'distributed': (None, 'distributed'),
    'lz4': (None, 'lz4'),
    'matplotlib': ('python3-matplotlib', 'matplotlib'),
    'numpy': ('python3-numpy', 'numpy'),
    'psutil': ('python3-psutil', 'psutil'),
    'pyarrow': (None, 'pyarrow'),
    'pybullet': ('pybullet-pip', 'pybullet'),
    'rich': ('python3-rich', 'rich'),
    'rosbags': ('python3-rosbags-pip', 'rosbags'),
    'scipy': ('python3-scipy', 'scipy'),
    'sqlalchemy': ('python3-sqlalchemy', 'sqlalchemy'),
    'typer': ('python3-typer', 'typer'),
    'yaml': ('python3-yaml', 'pyyaml'),
}


@pytest.mark.parametrize('package', PACKAGES)
def test_a_package_has_no_import_its_manifest_does_not_name(package: str) -> None:
    manifest = (SOURCES / package / 'package.xml').read_text(encoding='utf-8')
    ours = {name for p in (SOURCES / package / package).rglob('*.py') for name in imported(p)}
    keys = {name: key for name, (key, _) in KEYS.items() if key}
    keys |= {
        n: n
        for n in ours
        if n in ROS or n.endswith('_msgs') or n in PACKAGES or n == 'domain_coordinator'
    }
    keys.pop(package, None)
    missing = sorted(
        keys[name] for name in ours & keys.keys() if f'>{keys[name]}<' not in manifest
    )
    assert not missing, f'{package}/package.xml does not name {missing}.'


@pytest.mark.parametrize('package', PACKAGES)
def test_a_package_has_no_import_its_setup_does_not_name(package: str) -> None:
    setup = (SOURCES / package / 'setup.py').read_text(encoding='utf-8')
    ours = {name for p in (SOURCES / package / package).rglob('*.py') for name in imported(p)}
    known = {*sys.stdlib_module_names, *PACKAGES, *ROS, *COME_WITH_OTHERS, *KEYS}
    strangers = {name for name in ours - known if not name.endswith('_msgs')}
    assert not strangers, f'KEYS does not know {strangers}.'
    missing = sorted(
        pip for name, (_, pip) in KEYS.items() if name in ours and f"'{pip}" not in setup
    )
    assert not missing, f'{package}/setup.py does not name {missing}.'

"""package.xml and setup.py name what a package imports, by keys that rosdep knows."""

from __future__ import annotations

import re
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest
import yaml

from test_layering import PACKAGES, SOURCES, packages_of

KEYS = yaml.safe_load(Path(__file__).with_name('rosdep_keys.yaml').read_text(encoding='utf-8'))
#: What is imported: its key in rosdep, its name for pip.
NAMES = {
    'PIL': ('python3-pil', 'pillow'),
    'cv2': ('python3-opencv', 'opencv-python-headless'),
    'hypothesis': ('python3-hypothesis', 'hypothesis'),
    'jsonschema': ('python3-jsonschema', 'jsonschema'),
    'matplotlib': ('python3-matplotlib', 'matplotlib'),
    'numpy': ('python3-numpy', 'numpy'),
    'psutil': ('python3-psutil', 'psutil'),
    'pybullet': ('python3-pybullet-pip', 'pybullet'),
    'pybullet_data': ('python3-pybullet-pip', 'pybullet'),
    'pybullet_utils': ('python3-pybullet-pip', 'pybullet'),
    'pytest': ('python3-pytest', 'pytest'),
    'rich': ('python3-rich', 'rich'),
    'rosbags': ('python3-rosbags-pip', 'rosbags'),
    'scipy': ('python3-scipy', 'scipy'),
    'shapely': ('python3-shapely', 'shapely'),
    'sqlalchemy': ('python3-sqlalchemy', 'sqlalchemy'),
    'trimesh': ('python3-trimesh-pip', 'trimesh'),
    'typer': ('python3-typer', 'typer'),
    'yaml': ('python3-yaml', 'pyyaml'),
    # rosdep has no keys for these. The first three come with rosbags; each of the others serves
    # one option or one command, which says what to install.
    'apsw': (None, 'apsw'),
    'coal': (None, 'coal'),
    'pinocchio': (None, 'pin'),
    'ruckig': (None, 'ruckig'),
    'backports': (None, 'backports.zstd'),
    'lz4': (None, 'lz4'),
    'distributed': (None, 'distributed'),
    'aiohttp': (None, 'aiohttp'),
    'arviz': (None, 'arviz'),
    'foxglove': (None, 'foxglove-sdk'),
    'pyte': (None, 'pyte'),
    'rerun': (None, 'rerun-sdk'),
    'rerun_cli': (None, 'rerun-sdk'),
    'textual': (None, 'textual'),
    'textual_serve': (None, 'textual-serve'),
    'websockets': (None, 'websockets'),
    'pyarrow': (None, 'pyarrow'),
}
#: Helpers of tests that lie outside their package, and what they import; None: nothing to name.
HELPERS: dict[str, str | None] = {
    'graph': 'domain_coordinator', 'in_process': 'domain_coordinator',
    'transforms': 'geometry_msgs', 'unprivileged': None,
}  # fmt: skip
HELPER_FILES = {
    path.stem
    for folder in ('ros2_ws/src/*/test', 'benchmarks', 'tools')
    for path in SOURCES.parents[1].glob(f'{folder}/*')
}
MANIFESTS = sorted(SOURCES.glob('*/package.xml'))


def tags(manifest: Path) -> list[tuple[str, str]]:
    root = ElementTree.parse(manifest).getroot()
    return [(element.tag, (element.text or '').strip()) for element in root]


def keys_of(package: str, *, tests: bool) -> set[str]:
    kinds = {'depend', 'exec_depend', *(['test_depend'] if tests else [])}
    return {text for tag, text in tags(SOURCES / package / 'package.xml') if tag in kinds}


def imports_of(package: str, folder: str) -> set[str]:
    """What the files of a folder import, without this package, helpers and Python's own."""
    files = list((SOURCES / package / folder).rglob('*.py'))
    own = {package, *HELPER_FILES, *sys.stdlib_module_names}
    return {name for path in files for name in packages_of(path)} - own


def key_of(name: str) -> str | None:
    return NAMES[name][0] if name in NAMES else name


@pytest.mark.parametrize('package', PACKAGES)
def test_a_manifest_names_what_is_imported(package: str) -> None:
    imported = imports_of(package, package) | imports_of(package, 'launch')
    missing = {key_of(name) for name in imported} - keys_of(package, tests=False) - {None}
    assert not missing, f'{package}/package.xml does not name {missing}.'


@pytest.mark.parametrize('package', PACKAGES)
def test_a_manifest_names_what_its_tests_import(package: str) -> None:
    imported = {HELPERS.get(name, name) for name in imports_of(package, 'test')}
    named = keys_of(package, tests=True)
    missing = {key_of(name) for name in imported if name is not None} - named - {None}
    assert not missing, f'{package}/package.xml does not name {missing} for its tests.'


@pytest.mark.parametrize('package', PACKAGES)
def test_setup_names_what_is_imported(package: str) -> None:
    setup = (SOURCES / package / 'setup.py').read_text(encoding='utf-8')
    names = {NAMES[name][1] for name in imports_of(package, package) if name in NAMES}
    missing = {name for name in names if not re.search(f"'{re.escape(name)}(==[^']*)?'", setup)}
    assert not missing, f'{package}/setup.py does not name {missing}.'


@pytest.mark.parametrize('manifest', MANIFESTS, ids=lambda path: path.parent.name)
def test_every_key_is_one_of_the_table(manifest: Path) -> None:
    named = {text for tag, text in tags(manifest) if tag.endswith('depend')}
    known = {*KEYS['ros'], *KEYS['apt'], *KEYS['pip'], *(path.parent.name for path in MANIFESTS)}
    assert named <= known, f'rosdep_keys.yaml does not have {named - known}.'


def test_the_table_has_no_key_that_nobody_names() -> None:
    named = {text for path in MANIFESTS for tag, text in tags(path) if tag.endswith('depend')}
    assert {*KEYS['ros'], *KEYS['apt'], *KEYS['pip']} <= named


@pytest.mark.parametrize('manifest', MANIFESTS, ids=lambda path: path.parent.name)
def test_a_maintainer_has_an_address(manifest: Path) -> None:
    maintainer = ElementTree.parse(manifest).getroot().find('maintainer')
    assert maintainer is not None
    address = maintainer.get('email', '')
    assert re.fullmatch(r'[\w.+-]+@([\w-]+\.)+[a-z]{2,}', address)
    # RFC 2606 and 6761 reserve these for what does not exist.
    assert address.rpartition('.')[2] not in {'example', 'invalid', 'localhost', 'test'}
    setup = manifest.with_name('setup.py')
    assert not setup.exists() or f"maintainer_email='{address}'" in setup.read_text('utf-8')

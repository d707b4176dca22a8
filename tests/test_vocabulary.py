"""The same words and numbers everywhere: messages, enums, packages, scripts."""

from __future__ import annotations

import importlib
import importlib.util
import re
import runpy
import subprocess
import xml.etree.ElementTree as ElementTree
from enum import IntEnum
from functools import partial
from pathlib import Path

import pytest

from in_process import command

ROOT = Path(__file__).parents[1]
SOURCES = ROOT / 'ros2_ws' / 'src'
INTERFACES = SOURCES / 'likeme_msgs'
MANIFESTS = sorted(SOURCES.glob('*/package.xml'))
SCRIPTS = sorted(path for path in (ROOT / 'scripts').glob('*.sh') if path.name != 'env.sh')
#: Enums of likeme_core and the interface whose constants they are.
ENUMS = (
    ('likeme_core.tabletop', 'Manner', 'msg/Demonstration.msg'),
    ('likeme_core.outcomes', 'MotionOutcome', 'srv/ExecuteAction.srv'),
    ('likeme_core.outcomes', 'ResetOutcome', 'srv/ResetCell.srv'),
    ('likeme_core.outcomes', 'Actor', 'msg/Outcome.msg'),
)


def constants(interface: str) -> dict[str, int]:
    """The integer constants of a .msg or .srv file, read from its text."""
    text = (INTERFACES / interface).read_text(encoding='utf-8')
    return {
        name: int(value) for name, value in re.findall(r'^u?int\d+ ([A-Z_]+)=(\d+)', text, re.M)
    }


@pytest.mark.parametrize(('module', 'name', 'interface'), ENUMS)
def test_an_enum_has_the_numbers_of_the_interface(module: str, name: str, interface: str) -> None:
    enum: type[IntEnum] = getattr(importlib.import_module(module), name)
    published = constants(interface)
    assert {m.name: m.value for m in enum} == {m.name: published.get(m.name) for m in enum}


@pytest.mark.parametrize(('module', 'name', 'interface'), ENUMS)
def test_an_enum_is_complete(module: str, name: str, interface: str) -> None:
    enum = getattr(importlib.import_module(module), name)
    words = {
        'Manner': '.*',
        'MotionOutcome': '.*',
        'ResetOutcome': '.*',
        'Actor': 'ROBOT|HUMAN|NOBODY',
    }[name]
    found = {word for word in constants(interface) if re.fullmatch(words, word)}
    assert found == set(enum.__members__)


def test_the_built_messages_are_those_of_the_text() -> None:
    from likeme_msgs.msg import ObjectState
    from likeme_msgs.srv import ExecuteAction

    for interface, built in (
        ('msg/ObjectState.msg', ObjectState),
        ('srv/ExecuteAction.srv', ExecuteAction),
    ):
        sides = (built,) if interface.startswith('msg') else (built.Request, built.Response)
        for word, value in constants(interface).items():
            assert {getattr(side, word) for side in sides if hasattr(side, word)} == {value}


def test_all_packages_have_one_version() -> None:
    versions = {
        path.parent.name: ElementTree.parse(path).findtext('version') for path in MANIFESTS
    }
    for path in SOURCES.glob('*/setup.py'):
        found = re.search(r"version='([^']+)'", path.read_text(encoding='utf-8'))
        versions[str(path)] = found and found.group(1)
    found = re.search(
        r'^version: (\S+)', (ROOT / 'CITATION.cff').read_text(encoding='utf-8'), re.M
    )
    versions['CITATION.cff'] = found and found.group(1)
    assert len(versions) == 2 * len(MANIFESTS)
    assert len(set(versions.values())) == 1, versions


def test_every_manifest_is_format_3_under_one_licence() -> None:
    for path in MANIFESTS:
        manifest = ElementTree.parse(path).getroot()
        assert manifest.get('format') == '3'
        assert manifest.findtext('license') == 'Apache-2.0'
        assert manifest.findtext('name') == path.parent.name


@pytest.mark.parametrize('script', SCRIPTS, ids=lambda path: path.name)
def test_every_script_has_help(script: Path) -> None:
    answer = subprocess.run(
        [script, '--help'], capture_output=True, text=True, timeout=60, check=False
    )
    assert answer.returncode == 0, answer.stderr
    assert answer.stdout.startswith(f'Usage: scripts/{script.name}')
    assert answer.stderr == ''


@pytest.mark.filterwarnings('ignore:.* found in sys.modules:RuntimeWarning')
@pytest.mark.parametrize(
    ('script', 'module', 'words'),
    [
        ('start_cell.sh', 'likeme_bringup.start_cell', ()),
        ('arm.sh', 'likeme_bringup.ros.cell_commands', ('arm',)),
        ('show.sh', 'likeme_bringup.ros.cell_commands', ('show',)),
        ('cell.sh', 'likeme_bringup.ros.cell_commands', ('cell', 'reset')),
        ('demo.sh', 'likeme_bringup.demo', ()),
        ('gaze.sh', 'likeme_experiments.commands.gaze', ()),
        ('record.sh', 'likeme_replay.record', ()),
        ('replay.sh', 'likeme_replay.replay', ()),
        ('ask_human.sh', 'likeme_operator.ros.question_commands', ('answer',)),
        ('operator.sh', 'likeme_operator', ()),
        ('operator.sh', 'likeme_operator', ('answer',)),
        ('operator.sh', 'likeme_operator', ('whatif',)),
        ('operator.sh', 'likeme_operator', ('resume',)),
        ('operator.sh', 'likeme_operator', ('watch',)),
        ('operator.sh', 'likeme_operator', ('log',)),
        ('topic.sh', 'likeme_bringup.ros.topic_commands', ('echo',)),
        ('topic.sh', 'likeme_bringup.ros.topic_commands', ('hz',)),
        ('log.sh', 'likeme_inference.log_commands', ('show',)),
        ('log.sh', 'likeme_inference.log_commands', ('verify',)),
        ('log.sh', 'likeme_inference.log_commands', ('why',)),
        ('log.sh', 'likeme_inference.log_commands', ('export',)),
    ],
)
def test_a_scripts_help_names_every_option(
    script: str, module: str, words: tuple[str, ...]
) -> None:
    told = subprocess.run(
        [ROOT / 'scripts' / script, '--help'],
        capture_output=True,
        text=True,
        timeout=60,
        check=True,
    ).stdout
    program = partial(runpy.run_module, module, run_name='__main__')
    code, real, _ = command(program, 0, *words, '--help')
    assert code == 0
    options = set(re.findall(r'(?<![\w-])--[a-z][a-z-]+', real)) - {'--help'}
    assert options, real
    assert not {option for option in options if option not in told}


@pytest.mark.parametrize(
    ('script', 'words', 'said'),
    [
        ('test.sh', ('--fast', '--nope'), 'Expected options of pytest, got --nope.'),
        (
            'test.sh',
            ('tests/nope.py::test_a',),
            f'Expected a file of tests below {ROOT}, got tests/nope.py, which does not exist.',
        ),
        ('docs.sh', ('--nope',), 'Expected an option of mkdocs build, got --nope.'),
    ],
)
def test_a_wrong_option_for_a_program_that_a_script_calls(
    script: str, words: tuple[str, ...], said: str
) -> None:
    if script == 'docs.sh' and importlib.util.find_spec('mkdocs') is None:
        pytest.skip('scripts/docs.sh installs mkdocs')
    answer = subprocess.run(
        [ROOT / 'scripts' / script, *words],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert (answer.returncode, answer.stdout) == (2, '')
    assert answer.stderr == f'{script}: {said}\n'


@pytest.mark.parametrize('script', SCRIPTS, ids=lambda path: path.name)
def test_every_script_stops_at_the_first_failure(script: Path) -> None:
    assert '\nset -euo pipefail\n' in script.read_text(encoding='utf-8')
    assert script.stat().st_mode & 0o111

"""From a fresh clone to a workspace that runs, and nothing done twice."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
#: These tests make the usual environment, also where they run in the one of test.sh --noble.
NOBLE = os.environ.get('LIKEME_ENV') == 'noble'
DISTRIBUTION = Path(
    '/opt/ros/jazzy' if NOBLE else os.environ.get('LIKEME_ROS_PREFIX', '/opt/ros/jazzy'),
    'setup.bash',
)


def plain_environment() -> dict[str, str]:
    """The environment without what scripts/env.sh has put into it."""
    names = (
        'PATH',
        'HOME',
        'LANG',
        'TMPDIR',
        'SSL_CERT_FILE',
        'LIKEME_PYTHON',
        *(() if NOBLE else ('LIKEME_ROS_PREFIX',)),
    )
    prefixes = ('PIP_', 'UV_', 'PYENV_')
    kept = {n: v for n, v in os.environ.items() if n in names or n.startswith(prefixes)}
    # And .venv-noble.
    ours = str(ROOT / '.venv')
    kept['PATH'] = os.pathsep.join(
        p for p in kept['PATH'].split(os.pathsep) if not p.startswith(ours)
    )
    return kept


def run(
    *command: str | Path, cwd: Path, bound: float = 60.0, **environment: str
) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        command, cwd=cwd, env=plain_environment() | environment, capture_output=True, text=True,
        timeout=bound, check=False,
    )  # fmt: skip


@pytest.fixture(scope='module')
def clone(tmp_path_factory: pytest.TempPathFactory) -> Path:
    if not (ROOT / '.git').exists() or shutil.which('git') is None:
        pytest.skip('This tree is not a git clone.')
    if run('git', 'rev-parse', '--verify', '-q', 'HEAD', cwd=ROOT).returncode:
        pytest.skip('Nothing has been committed here.')
    # With a distribution's ROS 2 the path must be ASCII.
    letter = '' if DISTRIBUTION.exists() else 'é'
    target = tmp_path_factory.mktemp('fresh') / f'like me{letter}'
    answer = run('git', 'clone', '-q', '--no-hardlinks', ROOT, target, cwd=ROOT, bound=120)
    assert answer.returncode == 0, answer.stderr
    return target


def test_a_folder_that_is_not_ours_is_left_alone(clone: Path) -> None:
    (clone / '.venv').mkdir()
    answer = run('scripts/setup.sh', cwd=clone)
    (clone / '.venv').rmdir()
    assert answer.returncode == 1
    assert 'was not made by setup.sh' in answer.stderr


def test_a_wrong_python_is_named(clone: Path) -> None:
    answer = run('scripts/setup.sh', cwd=clone, LIKEME_PYTHON='/bin/false')
    assert not (clone / '.venv').exists()
    assert answer.returncode == 1
    assert 'LIKEME_PYTHON=/bin/false is not a Python 3.11 or 3.12 that starts.' in answer.stderr


def test_an_unknown_argument_is_a_usage_error(clone: Path) -> None:
    answer = run('scripts/setup.sh', '--fast', cwd=clone)
    assert answer.returncode == 2
    assert "unknown argument '--fast'" in answer.stderr


def scripts_in(folder: bytes | Path) -> bytes:
    """A folder that holds the scripts alone; its path."""
    path = os.fsencode(folder)
    shutil.copytree(os.fsencode(ROOT / 'scripts'), path + b'/scripts')
    return path


def set_up(folder: bytes, **environment: str) -> subprocess.CompletedProcess[bytes]:
    return subprocess.run(
        [folder + b'/scripts/setup.sh'], env=plain_environment() | environment,
        capture_output=True, timeout=60, check=False,
    )  # fmt: skip


@pytest.mark.parametrize('character', list('\'"`$#&()[]{}<>|;:,*?!%^=\\\n\t'))
def test_a_path_in_which_the_build_fails_is_refused_at_once(
    tmp_path: Path, character: str
) -> None:
    folder = scripts_in(tmp_path / f'a{character}b')
    answer = set_up(folder)
    assert answer.returncode == 1
    assert answer.stderr.startswith(b'setup: the path of this folder may have letters, digits, ')
    assert answer.stderr.count(b'\n') == 1
    assert os.listdir(folder) == [b'scripts']


@pytest.mark.parametrize('locale', ['C', 'C.UTF-8'])
def test_a_path_that_is_not_utf_8_is_refused_at_once(tmp_path: Path, locale: str) -> None:
    answer = set_up(scripts_in(os.fsencode(tmp_path) + b'/lat\xe9'), LC_ALL=locale)
    assert answer.returncode == 1
    assert b'the path of this folder is not UTF-8' in answer.stderr


def test_other_letters_are_refused_where_a_distribution_builds(tmp_path: Path) -> None:
    (tmp_path / 'ros').mkdir()
    (tmp_path / 'ros' / 'setup.bash').touch()
    answer = set_up(scripts_in(tmp_path / 'é'), LIKEME_ROS_PREFIX=str(tmp_path / 'ros'))
    assert answer.returncode == 1
    assert b'may have ASCII letters only' in answer.stderr


def test_compiled_modules_are_kept_in_the_environment() -> None:
    command = (
        'scripts/run.sh',
        'python',
        '-c',
        'import sys; print(sys.dont_write_bytecode, sys.pycache_prefix)',
    )
    environment = {'PYTHONDONTWRITEBYTECODE': '1', 'PYTHONPYCACHEPREFIX': '/no/such'}
    folder = '.venv-noble' if NOBLE else '.venv'
    asked = run(*command, cwd=ROOT, **environment, LIKEME_ENV='noble' if NOBLE else '')
    assert asked.stdout == f'False {ROOT / folder / "pycache"}\n'


@pytest.mark.slow
@pytest.mark.skipif(NOBLE, reason='of the usual environment')
@pytest.mark.timeout(900)
def test_fresh_clone_sets_up_once(clone: Path) -> None:
    answer = run('scripts/setup.sh', cwd=clone, bound=800)
    if 'the package index did not answer' in answer.stderr:
        pytest.skip(answer.stderr.strip().splitlines()[-1])
    assert answer.returncode == 0, answer.stderr

    made = [path.stat().st_mtime_ns for path in (clone / '.venv' / 'likeme').iterdir()]
    again = run('scripts/setup.sh', cwd=clone)
    assert (again.returncode, again.stdout, again.stderr) == (0, '', '')
    assert made == [path.stat().st_mtime_ns for path in (clone / '.venv' / 'likeme').iterdir()]

    parts = ('arm_sim', 'bringup', 'inference', 'msgs.msg', 'perception')
    names = ', '.join(f'likeme_{part}' for part in parts)
    used = run(
        'scripts/run.sh', 'python', '-c', f'import {names}; print(likeme_msgs.__file__)', cwd=clone
    )
    assert used.stdout.startswith(str(clone)), used.stderr
    node = clone / 'ros2_ws' / 'install' / 'likeme_bringup' / 'lib' / 'likeme_bringup' / 'cell'
    for command in (('scripts/run.sh', node, '--help'), ('scripts/check.sh', '--help')):
        assert run(*command, cwd=clone).returncode == 0
    sourced = f'source "{clone}/scripts/env.sh" && python -c "import likeme_msgs.msg"'
    assert run('bash', '-c', f'set -eu; {sourced}', cwd=Path('/')).returncode == 0
    assert (clone / '.venv' / 'pycache').is_dir()
    # Nothing but ignored files was made, and no compiled modules beside the sources.
    assert not list((clone / 'ros2_ws' / 'src').rglob('__pycache__'))
    assert run('git', 'status', '--porcelain', cwd=clone).stdout == ''

    # Interrupted half-way: no stamp, a hole in the environment. The workspace is built anew, too;
    # one package shows that.
    for package in (clone / 'ros2_ws' / 'src').iterdir():
        if package.name != 'likeme_core':
            shutil.rmtree(package)
    (clone / '.venv' / 'likeme' / 'env').unlink()
    shutil.rmtree(clone / '.venv' / 'bin')
    repaired = run('scripts/setup.sh', cwd=clone, bound=600)
    assert repaired.returncode == 0, repaired.stderr
    built = {path.parent.name for path in (clone / 'ros2_ws' / 'install').glob('*/share')}
    # Of the underlay, where the ROS 2 that is installed lacks it.
    assert built - {'tf2_msgs'} == {'likeme_core'}
    assert run('scripts/run.sh', 'python', '-c', 'import tf2_msgs.msg', cwd=clone).returncode == 0
    code = 'import likeme_core.ros.spin as spin; print(spin.__file__)'
    assert run('scripts/run.sh', 'python', '-c', code, cwd=clone).stdout.startswith(str(clone))

"""From a fresh clone to a workspace that runs, and nothing done twice."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


def plain_environment() -> dict[str, str]:
    """The environment without what scripts/env.sh has put into it."""
    names = (
        'PATH',
        'HOME',
        'LANG',
        'TMPDIR',
        'SSL_CERT_FILE',
        'LIKEME_ROS_PREFIX',
        'LIKEME_PYTHON',
    )
    prefixes = ('PIP_', 'UV_', 'PYENV_')
    kept = {n: v for n, v in os.environ.items() if n in names or n.startswith(prefixes)}
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
    target = tmp_path_factory.mktemp('fresh') / 'likeme'
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


@pytest.mark.slow
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
    # Nothing but ignored files was made.
    assert run('git', 'status', '--porcelain', cwd=clone).stdout == ''

    # Interrupted half-way: no stamp, a hole in the environment.
    (clone / '.venv' / 'likeme' / 'env').unlink()
    shutil.rmtree(clone / '.venv' / 'bin')
    repaired = run('scripts/setup.sh', cwd=clone, bound=600)
    assert repaired.returncode == 0, repaired.stderr
    assert (
        run('scripts/run.sh', 'python', '-c', 'import likeme_msgs.msg', cwd=clone).returncode == 0
    )

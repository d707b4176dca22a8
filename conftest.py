"""Keeps what cells of tests must remember (holds, motions, logs) away from the user's own."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator

import pytest

from likeme_core.shared_memory import remove_orphans


@pytest.fixture(scope='session', autouse=True)
def state_of_the_tests() -> Iterator[None]:
    """A folder for the state of all cells that one run of the tests starts."""
    folder = tempfile.mkdtemp(prefix='likeme_tests_')
    before = os.environ.get('LIKEME_STATE')
    os.environ['LIKEME_STATE'] = folder
    yield
    # Of the processes that tests have killed.
    remove_orphans()
    shutil.rmtree(folder, ignore_errors=True)
    if before is None:
        del os.environ['LIKEME_STATE']
    else:
        os.environ['LIKEME_STATE'] = before

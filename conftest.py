"""Keeps what cells of tests must remember (holds, motions, logs) away from the user's own."""

from __future__ import annotations

import inspect
import os
import shutil
import tempfile
from collections.abc import Iterator
from functools import partial, partialmethod

import pytest
from click import testing

from likeme_core.shared_memory import remove_orphans

# Click before 8.2 (Ubuntu 24.04) writes stderr into stdout unless it is told not to; then it does
# not flush it, and leaves it out of `output`.
if 'mix_stderr' in inspect.signature(testing.CliRunner).parameters:
    testing.CliRunner.__init__ = partialmethod(testing.CliRunner.__init__, mix_stderr=False)
    testing._NamedTextIOWrapper = partial(testing._NamedTextIOWrapper, write_through=True)
    testing.Result.output = property(lambda result: result.stdout + result.stderr)


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

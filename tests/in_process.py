"""Command lines and refused nodes in the test's own process, which saves the start of another.

Not for commands that call services: DDS often takes 3 s to discover another participant of its own
process.
"""

from __future__ import annotations

import io
import os
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from typing import Any, NamedTuple

import pytest
from domain_coordinator import domain_id

from graph import ros_arguments


class Answer(NamedTuple):
    """How a command ended, and what it wrote."""

    code: int
    stdout: str
    stderr: str


def command(entry_point: Callable[[], object], domain: int, *words: str) -> Answer:
    """Call an entry point as its console script does, on a ROS domain."""
    out, err = io.StringIO(), io.StringIO()
    with (
        pytest.MonkeyPatch.context() as patch,
        _signal_handlers_kept(),
        redirect_stdout(out),
        redirect_stderr(err),
    ):
        patch.setattr(sys, 'argv', ['command', *words])
        patch.setenv('ROS_DOMAIN_ID', str(domain))
        try:
            code = entry_point()
        except SystemExit as end:
            code = end.code
    assert isinstance(code, int | None), code
    return Answer(code or 0, out.getvalue(), err.getvalue())


def refusal(main: Callable[[], int], name: str, **parameters: Any) -> str:
    """Why the main function of a node does not start it with ROS parameters: its last line."""
    with domain_id() as domain:
        answer = command(main, domain, *ros_arguments(parameters))
    assert answer.code == os.EX_CONFIG
    assert answer.stdout == ''
    assert 'Traceback' not in answer.stderr
    begin, _, why = answer.stderr.splitlines()[-1].partition(' does not start: ')
    assert begin == name
    return why


@contextmanager
def _signal_handlers_kept() -> Iterator[None]:
    """Restore the handlers that a node's main function replaces."""
    kept = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in kept.items():
            signal.signal(number, handler)

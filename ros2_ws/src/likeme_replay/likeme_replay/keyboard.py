"""Single keys from a terminal without Enter, or bytes from a pipe."""

from __future__ import annotations

import os
import select
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from likeme_core.terminal import single_keys


@contextmanager
def keyboard() -> Iterator[Callable[[], str]]:
    """Yield a function that returns the keys pressed since its last call.

    Meanwhile the terminal is not line-buffered; Ctrl-C works as usual.
    """
    source = _descriptor()
    if source is None:
        yield lambda: ''
        return
    ended = False

    def keys() -> str:
        nonlocal ended
        if ended or not select.select([source], [], [], 0)[0]:
            return ''
        pressed = os.read(source, 64)
        ended = not pressed
        return pressed.decode('utf-8', 'replace')

    with single_keys(source):
        yield keys


def _descriptor() -> int | None:
    """Standard input, if there is one."""
    try:
        return None if sys.stdin is None else sys.stdin.fileno()
    except (OSError, ValueError):
        return None

"""Opening a physics client."""

from __future__ import annotations

import ctypes
import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pybullet
from pybullet_utils.bullet_client import BulletClient


def connect() -> Any:
    """A pybullet client of its own, in this process."""
    with _quiet():
        return BulletClient(pybullet.DIRECT)


@contextmanager
def _quiet() -> Iterator[None]:
    """Bullet's C code greets with a line on stdout whenever a client connects: swallow it."""
    kept, nowhere = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 1)
        yield
        # The greeting waits in the C library's buffer: it must be flushed before stdout is back.
        ctypes.CDLL(None).fflush(None)
    finally:
        os.dup2(kept, 1)
        os.close(kept)
        os.close(nowhere)

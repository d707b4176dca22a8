"""Connects to pybullet."""

from __future__ import annotations

import ctypes
import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pybullet
from pybullet_utils.bullet_client import BulletClient


def connect() -> Any:
    """A new pybullet client in this process."""
    with _quiet():
        return BulletClient(pybullet.DIRECT)


@contextmanager
def _quiet() -> Iterator[None]:
    """Discard the line that bullet's C code prints to stdout when a client connects."""
    saved, devnull = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(devnull, 1)
        yield
        # The line is in the C library's buffer: flush it before stdout is restored.
        ctypes.CDLL(None).fflush(None)
    finally:
        os.dup2(saved, 1)
        os.close(saved)
        os.close(devnull)

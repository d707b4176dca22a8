"""Runs programs that the modes of files hold for, also when the tests are run by root."""

from __future__ import annotations

import os
import subprocess
import sys

# Root may write where the file's mode forbids it, except without this capability.
UNPRIVILEGED = (
    ['setpriv', '--bounding-set=-dac_override,-dac_read_search'] if os.geteuid() == 0 else []
)


def unprivileged(program: str, *arguments: str) -> str:
    """What a Python program prints."""
    command = [*UNPRIVILEGED, sys.executable, '-c', program, *arguments]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()

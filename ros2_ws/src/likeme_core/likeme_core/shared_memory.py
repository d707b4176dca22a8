"""Removes shared memory that Fast DDS left behind when its process was killed.

A participant keeps a segment `fastrtps_ID` (35 MB with the profile of the cell) and a lock file
`fastrtps_ID_el`, whose lock the kernel releases when the process ends. Fast DDS removes neither
after kill -9.
"""

from __future__ import annotations

import fcntl
import os
import re
import time
from pathlib import Path

SHARED_MEMORY = Path('/dev/shm')
#: Age of a lock file, s, below which its process may not have locked it yet.
LEAST_AGE = 5.0
_LOCK_FILE = re.compile(r'fastrtps_[0-9a-f]{16}_el')


def remove_orphans(folder: Path = SHARED_MEMORY, least_age: float = LEAST_AGE) -> int:
    """Remove the segments of this user's dead participants; the number of them."""
    removed = 0
    try:
        names = [name for name in os.listdir(folder) if _LOCK_FILE.fullmatch(name)]
    except OSError:
        return 0
    for name in names:
        lock = folder / name
        try:
            old = time.time() - lock.stat().st_mtime >= least_age
            if old and _is_orphaned(lock):
                lock.with_name(name.removesuffix('_el')).unlink(missing_ok=True)
                lock.unlink()
                removed += 1
        except OSError:
            # Another user's, or gone meanwhile.
            continue
    return removed


def _is_orphaned(lock: Path) -> bool:
    """Whether no process holds the lock."""
    descriptor = os.open(lock, os.O_RDWR | os.O_CLOEXEC)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    finally:
        os.close(descriptor)
    return True

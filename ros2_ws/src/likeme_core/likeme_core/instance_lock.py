"""Lock against a second instance of a node on the same ROS domain of this host.

Two arm drivers would both execute each request. Linux only: a lock is an abstract Unix socket,
which the kernel releases however the process ends, without a file to clean up.
"""

from __future__ import annotations

import errno
import socket
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager


class AlreadyRunningError(Exception):
    """An instance already runs on this domain."""


@contextmanager
def claim(domain: int, parts: Iterable[str]) -> Iterator[None]:
    """Hold the locks of some parts (node names) of the cell on a ROS domain.

    Raises:
        AlreadyRunningError: another process holds one.
    """
    with ExitStack() as sockets:
        for part in parts:
            lock = sockets.enter_context(socket.socket(socket.AF_UNIX, socket.SOCK_STREAM))
            try:
                lock.bind(f'\0likeme/domain/{domain}/{part}')
            except OSError as error:
                if error.errno != errno.EADDRINUSE:
                    raise
                raise AlreadyRunningError(
                    f'{part} already runs on ROS domain {domain}: stop that cell, or choose '
                    'another domain with --domain.'
                ) from None
        yield


def is_free(domain: int, parts: Iterable[str]) -> bool:
    """Whether no instance of the parts runs on a ROS domain of this host."""
    try:
        with claim(domain, parts):
            return True
    except AlreadyRunningError:
        return False

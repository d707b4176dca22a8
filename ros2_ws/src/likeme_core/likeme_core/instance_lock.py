"""At most one of each part on a ROS domain of this host: two arms would both do what one is told.

Linux only: a part's name is an abstract Unix socket, which the kernel gives back however its
holder ends, and of which nothing is left on the disk.
"""

from __future__ import annotations

import errno
import socket
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager


class AlreadyRunningError(Exception):
    """A part runs on this domain already."""


@contextmanager
def claim(domain: int, parts: Iterable[str]) -> Iterator[None]:
    """Hold the names of parts on a ROS domain.

    Raises:
        AlreadyRunningError: somebody else holds one.
    """
    with ExitStack() as held:
        for part in parts:
            name = held.enter_context(socket.socket(socket.AF_UNIX, socket.SOCK_STREAM))
            try:
                name.bind(f'\0likeme/domain/{domain}/{part}')
            except OSError as error:
                if error.errno != errno.EADDRINUSE:
                    raise
                raise AlreadyRunningError(
                    f'{part} runs already on ROS domain {domain}: end that cell, or take another '
                    'domain with --domain.'
                ) from None
        yield


def is_free(domain: int, parts: Iterable[str]) -> bool:
    """Whether none of the parts runs on a ROS domain of this host."""
    try:
        with claim(domain, parts):
            return True
    except AlreadyRunningError:
        return False

"""A process that has imported a node's module and waits to become that node.

`python -m likeme_core.standby MODULE [ARGUMENT...]` imports the module and waits for a line on
stdin. Then it does what `python -m MODULE ARGUMENT...` does, without the time of the imports; at
end of file it ends. Its name in the process list is `importing`, then `standby` until it is told.

DDS looks for network interfaces when a process joins the graph, and never again: a process that
joined while the network was away would not be heard by other hosts. It starts anew instead.
"""

from __future__ import annotations

import importlib
import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import likeme_core.program
from likeme_core.networks import running_networks

#: What makes it the node.
GO = b'\n'
IMPORTING, WAITING = 'importing', 'standby'


def main(module: str, *arguments: str) -> int:
    """Import a module, wait, and run its `main`; the exit code."""
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    set_process_name(IMPORTING)
    sys.argv[1:] = arguments
    networks = running_networks()
    with discarded_output():
        node = importlib.import_module(module)
        # What the node imports or makes only when it is made.
        getattr(node, 'preload', lambda: None)()
    set_process_name(WAITING)
    if not os.read(sys.stdin.fileno(), len(GO)):
        return 0
    set_process_name('python')
    with open(os.devnull, 'rb') as nothing:
        os.dup2(nothing.fileno(), sys.stdin.fileno())
    name = str(node.__file__)
    if running_networks() - networks:
        # Until the program can take it, see likeme_core.program.
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        program = [sys.executable, '-m', likeme_core.program.__name__, name, module, *arguments]
        os.execv(sys.executable, program)
    sys.argv[0] = name
    return int(node.main())


@contextmanager
def discarded_output() -> Iterator[None]:
    """Discard what libraries print to stdout, from C too; errors go to stderr."""
    kept = os.dup(1)
    with open(os.devnull, 'wb') as nothing:
        os.dup2(nothing.fileno(), 1)
    try:
        yield
    finally:
        sys.stdout.flush()
        os.dup2(kept, 1)
        os.close(kept)


def set_process_name(name: str) -> None:
    """Name this process for `ps` and `top`."""
    Path('/proc/self/comm').write_text(name, encoding='ascii')


if __name__ == '__main__':
    try:
        sys.exit(main(*sys.argv[1:]))
    except KeyboardInterrupt:
        sys.exit(0)

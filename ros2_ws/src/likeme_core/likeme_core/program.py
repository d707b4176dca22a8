"""Run a program so that a signal ends it in one line, also while it imports its modules.

`python -m likeme_core.program NAME MODULE[:FUNCTION] [ARGUMENT...]` calls the function, else
`main`, as an entry point does; NAME is what the program calls itself, and the module may be a file
(.py). Python raises KeyboardInterrupt anywhere, and prints a traceback of tens of lines when that
is among the imports. SIGINT may be blocked until this module runs
(`env --block-signal=INT python ...`), so that none comes before it either.
"""

from __future__ import annotations

import os
import signal
import sys
from types import FrameType

INTERRUPTED = 'Interrupted.'
#: 128 + SIGINT, as shells have it.
EXIT_CODE = 130


def main(name: str, program: str, *arguments: str) -> int | None:
    """Import MODULE[:FUNCTION] and call it, its name and arguments in sys.argv; the exit code."""
    # Else it is ignored, as in a job that a script has started with `&`.
    handled = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if handled:
        signal.signal(signal.SIGINT, _end)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
    # Not at the top: what is imported before the handler is set is not covered by it.
    import importlib

    module, function = program.rsplit(':', 1) if ':' in program else (program, 'main')
    if module.endswith('.py'):
        folder, file = os.path.split(module)
        sys.path.insert(0, folder)
        module = file.removesuffix('.py')
    call = getattr(importlib.import_module(module), function)
    sys.argv = [name, *arguments]
    if handled:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        return call()  # type: ignore[no-any-return]
    except KeyboardInterrupt:
        print(INTERRUPTED, file=sys.stderr)  # noqa: T201
        return EXIT_CODE


def _end(number: int, frame: FrameType | None) -> None:
    """End at once: an import has nothing to put in order."""
    os.write(2, f'{INTERRUPTED}\n'.encode())
    os._exit(EXIT_CODE)


if __name__ == '__main__':
    sys.exit(main(*sys.argv[1:]))

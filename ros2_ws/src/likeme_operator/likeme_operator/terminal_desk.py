"""The desk in a terminal: a process that draws, and a small one before it that sees the keys.

A stop does not wait for a picture: SPACE is acted on before the program that draws has it.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from contextlib import suppress

import typer

from likeme_arm.ros.stop_command import StopNode
from likeme_operator.desk_layout import too_small
from likeme_operator.key_relay import relay_keys
from likeme_operator.operator_node import operator_node

#: Of the process that sees the keys, as of `nice`, where the user may.
PRIORITY = -10
#: Set for the process that draws.
DRAWS = 'LIKEME_DESK_DRAWS'
HOLD = b' '


def run_in_terminal(by: str, network: bool, domain: int, words: Sequence[str]) -> None:
    """Show the desk until `q`; exit code 2: the terminal is too small.

    words: of the command line.
    """
    size = os.get_terminal_size(sys.stdout.fileno())
    if sentence := too_small(size.columns, size.lines):
        typer.echo(f'{sentence} operator.sh --plain needs no screen.', err=True)
        raise typer.Exit(2)
    command = [sys.executable, '-m', 'likeme_operator', *words]
    with suppress(OSError):
        # Before there are threads, which inherit it.
        os.setpriority(os.PRIO_PROCESS, 0, PRIORITY)
        command = ['nice', '-n', str(-PRIORITY), *command]
    with operator_node(by, network, domain, lambda _: StopNode('key')) as node:

        def seen(keys: bytes) -> None:
            if HOLD in keys:
                node.send_stop(by)

        code = relay_keys(command, seen, {DRAWS: '1'})
    raise typer.Exit(code if code >= 0 else 1)

"""The process before the screen: it sees the keys first, and restores the terminal."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

pytest.importorskip('pyte', reason='pyte: scripts/operator.sh installs it')

from terminal import Terminal

#: Relays to a program and writes the keys that were seen into a file.
RELAY = """
import sys
from likeme_operator.key_relay import relay_keys
seen = open(sys.argv[1], 'wb', buffering=0)
sys.exit(relay_keys([sys.executable, '-c', sys.argv[2]], seen.write, {'INNER': 'yes'}))
"""
#: Takes the second screen and tells each byte; `x` ends it with exit code 7, `s` stops it.
PROGRAM = """
import os, signal, sys, termios, tty
tty.setraw(0)
sys.stdout.write('\\x1b[?1049h\\x1b[?25lready ' + os.environ['INNER'] + ' ')
sys.stdout.write('%dx%d\\r\\n' % os.get_terminal_size())
sys.stdout.flush()
while True:
    key = os.read(0, 1)
    if key == b's':
        signal.pause()
    if key == b'x':
        sys.stdout.write('\\x1b[?1049l\\x1b[?25h')
        sys.exit(7)
    print('got', key, end='\\r\\n', flush=True)
"""


@pytest.fixture
def relay(tmp_path: Path) -> Iterator[Terminal]:
    command = [sys.executable, '-c', RELAY, str(tmp_path / 'keys'), PROGRAM]
    terminal = Terminal(command, os.environ)
    terminal.shows('ready yes 80x24')
    yield terminal
    terminal.close()


def keys(folder: Path) -> bytes:
    return (folder / 'keys').read_bytes()


def test_keys_are_seen_before_the_program_has_them(relay: Terminal, tmp_path: Path) -> None:
    relay.type('a')
    relay.shows("got b'a'")
    relay.type('s', 'SPACE')
    # The program has not read it.
    relay.until(lambda _: keys(tmp_path) == b'as ', 10, 'the key')
    assert "got b' '" not in relay.text


def test_the_exit_code_is_the_programs(relay: Terminal) -> None:
    # Ctrl-C is a key, the program decides.
    relay.type('\x03')
    relay.shows("got b'\\x03'")
    relay.type('x')
    assert relay.ends(10) == 7
    assert relay.restored


def test_a_killed_program_leaves_a_usable_terminal(relay: Terminal) -> None:
    children = Path(f'/proc/{relay.process.pid}/task/{relay.process.pid}/children').read_text()
    os.kill(int(children.split()[0]), 9)
    assert relay.ends(10) != 0
    assert relay.restored

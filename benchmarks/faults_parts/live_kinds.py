"""Faults of node processes. Each returns what ends it, called after its duration."""

from __future__ import annotations

import os
import shutil
import sqlite3
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from copy import deepcopy
from typing import Any, NamedTuple

import numpy as np
from rosgraph_msgs.msg import Clock
from std_srvs.srv import Trigger

from faults_parts.live_cell import INJECTED, MAY_CUT, MAY_MOUNT, NAMES, LiveCell
from likeme_bringup.start_cell import Part
from likeme_inference.experience.decision_log import LOG_FILE

MOMENTS = ('showing', 'shown', 'decided', 'asked', 'moving', 'moved')
#: Share of its time for which a slow node does not run, and the period of its pauses, s.
SLOW_SHARE, SLOW_PERIOD = 0.9, 0.05
#: By how much a clock jumps, s.
JUMP = 3600
#: Ends a fault; what went wrong with it, if anything did.
End = Callable[[], str | None]


class LiveFault(NamedTuple):
    """A fault: its kind, moment, the node that it is about, and how long it lasts, s."""

    kind: str
    moment: str
    part: Part
    duration: float


def draw(rng: np.random.Generator, first: int, count: int) -> list[LiveFault]:
    """The faults of a story, as many as it has moments or fewer, each kind in its turn."""
    moments = rng.choice(MOMENTS, size=count, replace=False)
    return [
        LiveFault(
            list(KINDS)[(first + number) % len(KINDS)],
            str(moment),
            list(NAMES)[int(rng.integers(len(NAMES)))],
            float(rng.uniform(0.3, 2.5)),
        )
        for number, moment in enumerate(moments)
    ]


def _nothing() -> None:
    """Nothing has to be ended."""


def _kill(cell: LiveCell, fault: LiveFault) -> End:
    process = cell.process(fault.part)
    if process is not None:
        process.kill()
    return _nothing


def _stop(cell: LiveCell, fault: LiveFault) -> End:
    process = cell.process(fault.part)
    if process is None:
        return _nothing
    process.suspend()

    def end() -> None:
        process.resume()

    return end


def _slow(cell: LiveCell, fault: LiveFault) -> End:
    """A node that runs for a tenth of the time."""
    process, over = cell.process(fault.part), threading.Event()

    def run() -> None:
        while process is not None and process.is_running() and not over.is_set():
            process.suspend()
            over.wait(SLOW_PERIOD * SLOW_SHARE)
            process.resume()
            time.sleep(SLOW_PERIOD * (1 - SLOW_SHARE))

    thread = threading.Thread(target=run, daemon=True)
    thread.start()

    def end() -> None:
        over.set()
        thread.join()

    return end


def _locked(cell: LiveCell, _: LiveFault) -> End:
    other = sqlite3.connect(cell.folder / LOG_FILE, isolation_level=None, timeout=5.0)
    other.execute('BEGIN EXCLUSIVE')
    return other.close


def _read_only(cell: LiveCell, _: LiveFault) -> End:
    """The files of the decision log can be read and not written, also where they are open."""
    files = [str(path) for path in sorted(cell.folder.glob(f'{LOG_FILE}*'))]
    subprocess.run(['chattr', '+i', *files], check=True)

    def end() -> None:
        subprocess.run(['chattr', '-i', *files], check=True)

    return end


def _clock_jumps(cell: LiveCell, fault: LiveFault) -> End:
    """/clock is an hour ahead or back, once; the cell's own clock goes on."""
    if cell.table is not None:
        stamp = deepcopy(cell.table.header.stamp)
        ahead = int(fault.duration * 1000) % 2 == 0
        stamp.sec = stamp.sec + JUMP if ahead else max(0, stamp.sec - JUMP)
        cell.clock.publish(Clock(clock=stamp))
    return _nothing


def _full(cell: LiveCell, _: LiveFault) -> End:
    """The file system of the cell's state, which is its own, has no room left."""
    filler = cell.folder / 'filler'
    with filler.open('wb', buffering=0) as file:
        for size in (2**20, 2**12, 1):
            with suppress(OSError):
                while True:
                    file.write(bytes(size))
    return filler.unlink


def _cut(cell: LiveCell, fault: LiveFault) -> End:
    """The host of a node is off the network."""
    host = cell.hosts[fault.part]
    host.connect(False)

    def end() -> None:
        host.connect(True)

    return end


def _hold(cell: LiveCell, _: LiveFault) -> End:
    cell.hold.call_async(Trigger.Request())

    def end() -> str:
        answer = cell.ask(cell.resume, Trigger.Request(), 30.0)
        return '' if answer is not None and answer.success else 'the cell was not resumed'

    return end


def _hold_and_kill(cell: LiveCell, fault: LiveFault) -> End:
    end = _hold(cell, fault)
    held = cell.until(lambda: bool(cell.watch.monitor.seen.hold.held), 5.0)
    if held:
        _kill(cell, fault)
    return end


def _inject(change: Callable[[Any], None]) -> Callable[[LiveCell, LiveFault], End]:
    """Publish the last demonstration and the last table state again, changed."""

    def begin(cell: LiveCell, _: LiveFault) -> End:
        shown = next(reversed(cell.watch.monitor.seen.demonstrations.values()), None)
        for message, publisher in ((shown, cell.demonstrations), (cell.table, cell.tables)):
            if message is not None:
                again = deepcopy(message)
                again.header.frame_id = INJECTED
                change(again)
                publisher.publish(again)
        return _nothing

    return begin


def _wrong(message: Any) -> None:
    if hasattr(message, 'x_i'):
        message.x_i = 77
    else:
        message.objects[0].state = 99


def _other_world(message: Any) -> None:
    message.world = 'another@world'


def _second_cell(cell: LiveCell, _: LiveFault) -> End:
    """A second cell on the domain; it must refuse to start."""
    command = [sys.executable, '-m', 'likeme_bringup.start_cell', '--domain', str(cell.domain)]
    other = subprocess.Popen(command, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)

    def end() -> str:
        # The policies are checked meanwhile.
        if not cell.until(lambda: other.poll() is not None, 60.0):
            other.terminate()
            cell.until(lambda: other.poll() is not None, 60.0)
            return 'a second cell started on the same domain'
        code = other.returncode
        return '' if code == 1 else f'a second cell ended with exit code {code}, not 1'

    return end


KINDS: dict[str, Callable[[LiveCell, LiveFault], End]] = {
    'kill -9': _kill,
    'SIGSTOP and CONT': _stop,
    'store locked': _locked,
    'hold and kill -9': _hold_and_kill,
    'clock jumps': _clock_jumps,
    'slow node': _slow,
    'doubled messages': _inject(lambda message: None),
    'corrupt messages': _inject(_wrong),
    'messages of another world': _inject(_other_world),
    'hold': _hold,
    'operator vanishes, kill -9': _kill,
    'two operators': lambda cell, fault: _nothing,
    'answers twice': lambda cell, fault: _nothing,
    'two cells': _second_cell,
}
# Only the superuser can make a file immutable; a mode is no hindrance to it.
if os.geteuid() == 0 and shutil.which('chattr'):
    KINDS['store read-only'] = _read_only
if MAY_CUT:
    KINDS['network cut'] = _cut
if MAY_MOUNT:
    KINDS['disk full'] = _full

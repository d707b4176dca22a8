"""The campaign of faults, short: nothing is violated or lost, and it finds what is planted."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from faults_parts import live
from faults_parts.live_cell import MAY_MOUNT
from likeme_replay.policies.seen import Seen

BENCHMARKS = Path(__file__).parents[1] / 'benchmarks'


def measured(*options: str) -> tuple[dict[str, float], dict[str, Any], int]:
    """The measured figures by name, the notes, and the exit code."""
    done = subprocess.run(
        [sys.executable, str(BENCHMARKS / 'faults.py'), '--json', *options],
        capture_output=True, text=True, timeout=280, check=False,
    )  # fmt: skip
    assert done.returncode in (0, 1), done.stderr
    report = json.loads(done.stdout[done.stdout.index('{') :])
    bars = {bar['name'].partition(': ')[2]: bar['measured'] for bar in report['bars']}
    return bars, report['notes'], done.returncode


def test_two_hundred_faults_in_simulated_time() -> None:
    bars, notes, code = measured('--n', '200', '--live', '0')
    wrong = ('violations', 'unfinished stories', 'lost questions', 'lost log entries')
    assert not any(bars[name] for name in wrong), notes['offline troubles']
    assert sum(notes['offline faults'].values()) == 200
    assert len(notes['offline faults']) > 20
    assert code == 0


#: Defects, and what they break.
PLANTED = {
    'nothing is restored': (
        'inference_node.restore = lambda log: Restored()', 'kill', 'decision_ids_count_up',
    ),
    'a decision is published before it is logged': (
        'SessionLog.record = lambda *_: None', 'double', 'published before it was logged',
    ),
    'the arm does not hear of the hold': (
        'HoldMonitor.block = property(lambda self: None)', 'hold', 'joints_rest_while_held',
    ),
    'the arm forgets its requests': (
        'offline._STORES._begin = lambda *_: None', 'double late', 'motions_begin_once',
    ),
}  # fmt: skip
SCRIPT = """
import sys
sys.path.insert(0, {benchmarks!r})
from faults_parts import offline
from likeme_arm.hold_monitor import HoldMonitor
from likeme_inference import inference_node
from likeme_inference.session_log import SessionLog
from likeme_inference.session_restore import Restored
{defect}
for number in range(40):
    found = [each.what for each in offline.play_cell(number, 10, ({kind!r},)).violations]
    if any({broken!r} in each for each in found):
        raise SystemExit(0)
raise SystemExit(f'Expected {broken}, got {{found}}.')
"""


@pytest.mark.parametrize('name', PLANTED)
def test_a_planted_defect_is_found(name: str) -> None:
    defect, kind, broken = PLANTED[name]
    script = SCRIPT.format(benchmarks=str(BENCHMARKS), defect=defect, kind=kind, broken=broken)
    done = subprocess.run(
        [sys.executable, '-c', script], capture_output=True, text=True, timeout=200, check=False
    )
    assert done.returncode == 0, done.stderr[-2000:]


@pytest.mark.graph
@pytest.mark.slow
def test_faults_of_processes() -> None:
    bars, notes, _ = measured('--n', '0', '--live', '3')
    wrong = ('violations', 'unfinished stories', 'lost questions', 'lost log entries')
    assert not any(bars[name] for name in wrong), notes['live troubles']
    assert sum(notes['live faults'].values()) == 3


def test_a_live_story_goes_on_with_the_question_that_follows_a_way_that_is_not_free() -> None:
    seen = Seen()

    def hear(topic: str, **fields: Any) -> None:
        header = SimpleNamespace(stamp=SimpleNamespace(sec=1, nanosec=0))
        seen.update(topic, SimpleNamespace(header=header, object='pear', **fields), 0.0)

    events = [
        lambda: hear('outcome', decision_id=1, result=3, motion_outcome=live.NOT_FREE),
        lambda: hear('decision', id=2, kind=live.ASK_HUMAN),
        lambda: hear('outcome', decision_id=2, result=4, motion_outcome=255),
    ]

    def until(condition: Any, _: float) -> bool:
        while not condition():
            if not events:
                return False
            events.pop(0)()
        return True

    watch = SimpleNamespace(monitor=SimpleNamespace(seen=seen))
    cell: Any = SimpleNamespace(
        watch=watch, until=until, ask=lambda *_: SimpleNamespace(pending=()), desk=None
    )
    hear('decision', id=1, kind=live.EXECUTE)
    story = live.Story(cell, [], np.random.default_rng(1), live.Found())
    assert story._until_closed()
    assert seen.open_decision is None
    assert list(seen.outcomes) == [1, 2]


FULL_DISK = """
import sys
sys.path.insert(0, {benchmarks!r})
from faults_parts.live_cell import live_cell
from faults_parts.live_kinds import KINDS, LiveFault
from likeme_bringup.start_cell import Part
from likeme_core.heartbeats import NodeState
from std_srvs.srv import Trigger
with live_cell(1) as cell:
    before = cell.process(Part.INFERENCE)
    end = KINDS['disk full'](cell, LiveFault('disk full', '', Part.INFERENCE, 0.0))
    cell.hold.call_async(Trigger.Request())
    state = lambda: cell.heartbeats.nodes['/inference_node'].state
    assert cell.until(lambda: state() is NodeState.DEGRADED, 60), state()
    end()
    assert cell.until(lambda: cell.ready, 60), state()
    assert cell.process(Part.INFERENCE) == before, 'The inference node died of a full disk.'
    assert cell.check_log() == ([], '')
"""


CUT_OFF = """
import sys
sys.path.insert(0, {benchmarks!r})
from virtual_hosts.hosts import own_network
if not own_network():
    sys.exit({skipped})
import time
from faults_parts.live_cell import NAMES, live_cell
from faults_parts.live_kinds import KINDS, LiveFault
from likeme_bringup.start_cell import Part
with live_cell(1) as cell:
    before = {{part: cell.process(part) for part in NAMES}}
    alive = lambda part: cell.heartbeats.alive(NAMES[part], time.monotonic())
    end = KINDS['network cut'](cell, LiveFault('network cut', '', Part.HOLD, 0.0))
    others = Part.ARM, Part.PERCEPTION, Part.INFERENCE
    alone = lambda: not alive(Part.HOLD) and all(alive(part) for part in others)
    assert cell.until(alone, 60), 'The keeper is still heard, or another node is not.'
    end()
    assert cell.until(lambda: cell.ready, 60), 'The keeper is not heard again.'
    assert {{part: cell.process(part) for part in NAMES}} == before, 'A node was started again.'
    # A standby that joined the graph while it was cut off takes over.
    end = KINDS['network cut'](cell, LiveFault('network cut', '', Part.HOLD, 0.0))
    assert cell.until(lambda: cell.standby(Part.HOLD), 60)
    first = cell.standby(Part.HOLD)
    cell.process(Part.HOLD).kill()
    assert cell.until(lambda: cell.standby(Part.HOLD) not in (None, first), 60), 'No new standby.'
    end()
    assert cell.until(lambda: cell.ready, 60), 'The second keeper is not heard.'
    run = cell.heartbeats.nodes[NAMES[Part.HOLD]].run
    cell.process(Part.HOLD).kill()
    assert cell.until(lambda: cell.heartbeats.nodes[NAMES[Part.HOLD]].run != run, 60), 'Not heard.'
    assert cell.until(lambda: cell.ready, 60)
    assert not cell.watch.monitor.violations, cell.watch.monitor.violations
"""
SKIPPED = 77


@pytest.mark.graph
@pytest.mark.slow
def test_a_keeper_that_is_cut_off_the_network_is_missed_and_heard_again() -> None:
    script = CUT_OFF.format(benchmarks=str(BENCHMARKS), skipped=SKIPPED)
    done = subprocess.run(
        [sys.executable, '-c', script], capture_output=True, text=True, timeout=200, check=False
    )
    if done.returncode == SKIPPED:
        pytest.skip('network namespaces are not allowed here')
    assert done.returncode == 0, done.stderr[-2000:]


@pytest.mark.graph
@pytest.mark.slow
@pytest.mark.skipif(not MAY_MOUNT, reason='only the superuser can mount a file system')
def test_a_full_disk_is_survived_and_what_was_told_meanwhile_is_logged() -> None:
    script = FULL_DISK.format(benchmarks=str(BENCHMARKS))
    done = subprocess.run(
        [sys.executable, '-c', script], capture_output=True, text=True, timeout=200, check=False
    )
    assert done.returncode == 0, done.stderr[-2000:]

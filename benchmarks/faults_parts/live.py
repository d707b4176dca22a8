"""Faults of node processes, several in each story, while people go on with it in one cell."""

from __future__ import annotations

import time
import uuid
from collections import Counter
from copy import deepcopy
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from faults_parts import live_kinds
from faults_parts.live_cell import NAMES, LiveCell, live_cell
from faults_parts.live_kinds import KINDS, LiveFault
from likeme_core.heartbeats import NodeState
from likeme_core.paper_world import WORLD
from likeme_core.progress_bar import counted
from likeme_msgs.srv import AskHuman, ExecuteAction, ResetCell
from report import Bar

EXECUTE, ASK_HUMAN, AT_GOAL, NO_ACTION = range(4)
UNDER_WAY = 1
#: The outcome of a motion that did not begin, as something was in the way.
NOT_FREE = 14
DONE_BY_HAND, TRY_ANYWAY, SKIP = range(3)
#: s of the machine, generous: both cores may be busy.
PATIENCE = 60.0
#: s of the machine for perception and inference to see what was shown.
SEEING = 30.0
ATTEMPTS = 4
#: Faults of one story.
PER_STORY = 5
OBJECTS = ('pear', 'lemon', 'chicken')


@dataclass
class Found:
    """Results of the live campaign.

    Attributes:
        faults: by kind.
        unfinished: stories that came to no outcome, and why.
        detection, recovery: s from each kill, to its notice and to the next READY run.
    """

    faults: Counter[str] = field(default_factory=Counter)
    unfinished: list[str] = field(default_factory=list)
    detection: list[float] = field(default_factory=list)
    recovery: list[float] = field(default_factory=list)


class Story:
    """One story with its faults, each at a moment of its own."""

    def __init__(
        self, cell: LiveCell, faults: list[LiveFault], rng: np.random.Generator, found: Found
    ) -> None:
        self._cell, self._rng, self._found = cell, rng, found
        self._to_come = list(faults)
        self._kinds = {fault.kind for fault in faults}
        self._seen = cell.watch.monitor.seen
        self._under_way: LiveFault | None = None
        self._end: live_kinds.End | None = None
        self._until = 0.0
        # What came of each attempt to show.
        self._attempts: list[str] = []

    def play(self) -> str:
        """Play it; why it did not come to an end, empty: it did."""
        name = str(self._rng.choice(OBJECTS))
        x_i, x_f = (str(s) for s in self._rng.permutation(['left', 'right']))
        why = ''
        if not self._until_decided(name, x_i, x_f):
            why = f'no decision: {"; ".join(self._attempts)}'
        elif not self._until_closed():
            why = 'no outcome'
        # What had no moment to come at comes when nothing is under way.
        while self._to_come:
            self._come(self._to_come[0])
            self._wait(lambda: self._end is None, PATIENCE)
        self._over(force=True)
        if not self._cell.until(lambda: self._cell.ready, PATIENCE):
            why = why or 'not READY again'
        return why

    def _until_decided(self, name: str, x_i: str, x_f: str) -> bool:
        last = 0 if self._seen.decision is None else int(self._seen.decision.id)

        def decided() -> bool:
            self._over()
            latest = self._seen.decision
            return latest is not None and latest.id > last and latest.kind != AT_GOAL

        for _ in range(ATTEMPTS):
            if self._set(name, x_i, 'cell/reset before') and decided():
                return True
            self._settle()
            before = set(self._seen.beliefs)
            self._moment('showing')
            # With an id it is carried out once, however often it is sent.
            act = ExecuteAction.Request(
                object=name, action=f'place_{x_f}', id=f'person-{uuid.uuid4()}'
            )
            done = self._call(self._cell.person, act)
            if done is None:
                self._attempts.append('the person did not answer')
                continue
            if not self._wait(lambda known=before: set(self._seen.beliefs) - known, SEEING):
                self._attempts.append(f'no belief after {done.message!r}')
                continue
            self._moment('shown')
            self._set(name, x_i, 'cell/reset after')
            if self._wait(decided, SEEING):
                return True
            self._attempts.append('a belief alone')
        return decided()

    def _until_closed(self) -> bool:
        self._moment('decided')
        tried: set[int] = set()

        def closed() -> bool:
            self._over()
            waiting = self._seen.open_decision
            if waiting is None:
                return True
            if any(m.state == UNDER_WAY and m.actor == 0 for m in self._seen.motions.values()):
                self._moment('moving')
            if waiting.kind == ASK_HUMAN and waiting.id not in self._seen.answers:
                self._moment('asked')
                self._answer(tried)
            return False

        done = self._cell.until(closed, 2 * PATIENCE)
        while done and self._decides_anew():
            # A question that nobody answers would take the next demonstration for its answer.
            if not self._wait(lambda: self._seen.open_decision is not None, SEEING):
                break
            done = self._cell.until(closed, 2 * PATIENCE)
        self._moment('moved')
        return done

    def _decides_anew(self) -> bool:
        """Whether another decision follows, as something was in the way of the last one."""
        latest = next(reversed(self._seen.outcomes.values()), None)
        return latest is not None and latest.motion_outcome == NOT_FREE

    def _answer(self, tried: set[int]) -> None:
        """Answer what is listed, as read."""
        cell, kinds = self._cell, self._kinds
        listed = self._call(cell.desk, AskHuman.Request(command=AskHuman.Request.LIST))
        for item in listed.pending if listed is not None else ():
            reply = int(self._rng.integers(3))
            if 'operator vanishes, kill -9' in kinds and item.id not in tried:
                tried.add(int(item.id))
                self._wait(lambda: False, 2.0)
                continue
            request = AskHuman.Request(
                command=AskHuman.Request.ANSWER, request_id=item.id, answer=reply,
                answered_by='ann', object=item.object,
                action=WORLD.actions[item.action].name, stamp=item.header.stamp,
            )  # fmt: skip
            futures = [(request, cell.desk.call_async(request))]
            if kinds & {'two operators', 'answers twice'}:
                other = (reply + 1) % 3 if 'two operators' in kinds else reply
                again = deepcopy(request)
                again.answer, again.answered_by = other, 'bob'
                futures.append((again, cell.desk.call_async(again)))
            self._all_done([future for _, future in futures])
            for sent, future in futures:
                if future.done() and future.result().success:
                    cell.watch.ledger.answered(int(sent.request_id), int(sent.answer))
                    if sent.answer == DONE_BY_HAND:
                        goal = WORLD.states[item.goal].name.lower()
                        self._set(item.object, goal, 'done by hand')

    def _all_done(self, futures: list[Any]) -> bool:
        return self._cell.until(lambda: all(future.done() for future in futures), 5.0)

    def _set(self, name: str, region: str, _why: str) -> bool:
        request = ResetCell.Request(
            objects=[name], states=[region], seed=int(self._rng.integers(99))
        )
        for _ in range(20):
            answer = self._call(self._cell.reset, request)
            if answer is not None and answer.success:
                return True
            # BUSY: a motion has not ended.
            self._wait(lambda: False, 0.5)
        return False

    def _settle(self) -> None:
        cell = self._cell
        begin = cell.table
        self._wait(
            lambda: cell.table is not None and cell.table is not begin and cell.table.settled, 15.0
        )

    def _call(self, client: Any, request: Any) -> Any:
        return self._cell.ask(client, request, 30.0, self._over)

    def _wait(self, condition: Any, seconds: float) -> bool:
        def checked() -> bool:
            self._over()
            return bool(condition())

        return self._cell.until(checked, seconds)

    def _moment(self, moment: str) -> None:
        for fault in [each for each in self._to_come if each.moment == moment]:
            self._come(fault)

    def _come(self, fault: LiveFault) -> None:
        """Have a fault come, once, after the one before it."""
        self._to_come.remove(fault)
        self._over(force=True)
        cell = self._cell
        # A record is replaced at each heartbeat.
        nodes, name = cell.heartbeats.nodes, NAMES[fault.part]
        run = nodes[name].run
        self._found.faults[fault.kind] += 1
        begin = time.monotonic()
        self._under_way, self._end = fault, KINDS[fault.kind](cell, fault)
        self._until = time.monotonic() + fault.duration
        if fault.kind != 'kill -9':
            return
        noticed = cell.until(
            lambda: nodes[name].run != run or not cell.heartbeats.alive(name, time.monotonic()),
            PATIENCE,
        )
        if noticed:
            self._found.detection.append(time.monotonic() - begin)
        if cell.until(
            lambda: nodes[name].run != run and nodes[name].state is NodeState.READY, PATIENCE
        ):
            self._found.recovery.append(time.monotonic() - begin)

    def _over(self, force: bool = False) -> None:
        """End the fault when its time is over."""
        if self._end is not None and (force or time.monotonic() >= self._until):
            end, self._end = self._end, None
            wrong = end()
            if wrong:
                self._found.unfinished.append(f'{self._under_way}: {wrong}')


def measure(count: int, seed: int) -> tuple[list[Bar], dict[str, Any]]:
    """Run so many live faults; bars and notes."""
    rng, found = np.random.default_rng(seed), Found()
    begin = time.monotonic()
    with live_cell(seed) as cell:
        stories = range(0, count, PER_STORY)
        for first in counted(stories, f'stories of {PER_STORY} live faults', len(stories)):
            faults = live_kinds.draw(rng, first, min(PER_STORY, count - first))
            why = Story(cell, faults, rng, found).play()
            if why:
                found.unfinished.append(f'faults from {first}, {faults}: {why}')
        cell.until(lambda: False, 3.0)
        monitor = cell.watch.monitor
        lost, problem = cell.check_log()
        asking = monitor.seen.open_decision
    questions = [] if asking is None or asking.kind != ASK_HUMAN else [asking.id]
    entries = [str(key) for key in lost] + ([problem] if problem else [])
    broken = [f'{v.policy}: {v.sentence}' for v in monitor.violations]
    notes = {
        'live': f'{time.monotonic() - begin:.0f} s',
        'live faults': dict(found.faults),
        'live troubles': broken + found.unfinished + entries,
    }
    source = 'the campaign'
    bars = [
        Bar('live: violations', len(broken), 0, 'violations', source, count),
        Bar('live: unfinished stories', len(found.unfinished), 0, 'stories', source, count),
        Bar('live: lost questions', len(questions), 0, 'questions', source, count),
        Bar('live: lost log entries', len(entries), 0, 'entries', source, count),
    ]
    # Without a bar: this process checks all policies meanwhile. See `bench.sh recovery`.
    for what, values in (('detection', found.detection), ('recovery', found.recovery)):
        for p in (50, 99) if values else ():
            measured = float(np.percentile(values, p))
            bars.append(Bar(f'live: {what}, p{p}', measured, None, 's', None, len(values)))
    return bars, notes

"""The order of a replay: frames and session inputs, one after another.

A replay target is the cores in this process, or nodes that acknowledge everything over the
network. Nothing here depends on a clock: an input is given when the one before it has ended.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from typing import NamedTuple, Protocol

from likeme_inference.session_inputs import InputKind, SessionInput
from likeme_replay.decision_log import LogEntry
from likeme_replay.recorded_inputs import RecordedFrame, ReplayStep
from likeme_replay.replay_counts import ReplayCounts


class FrameAck(NamedTuple):
    """Perception's acknowledgement of a frame; `rejection`: why it was not read, or ''."""

    table_state: bool
    demonstrations: tuple[LogEntry, ...] = ()
    rejection: str = ''


class ReplayTarget(Protocol):
    """Perception and inference as a replay sees them.

    refused_inputs: recorded reports of arm or operator that the session refused.
    """

    refused_inputs: int

    def show_frame(self, frame: RecordedFrame) -> FrameAck:
        """Show perception a frame; returns when it is processed."""

    def apply_input(self, item: SessionInput) -> list[LogEntry]:
        """Have the session apply an input; the events that follow, in order."""


class InputScheduler:
    """Decides which session input is next, so that none precedes the frame it is about.

    Without recorded inputs every table state is one, followed by the demonstrations of its frame.
    """

    def __init__(self, recorded: bool) -> None:
        self._recorded = recorded
        self._inputs: deque[SessionInput] = deque()
        # Messages of perception that are in no input yet, by stamp.
        self._available: dict[int, dict[InputKind, int]] = {}
        self._newest = -1
        self.missed = self.unrecorded = 0

    def add_input(self, item: SessionInput) -> None:
        """Append a recorded input."""
        self._inputs.append(item)

    def add_frame(self, stamp: int, ack: FrameAck) -> None:
        """Note what a frame led to."""
        acts = len(ack.demonstrations)
        self._newest = stamp
        if self._recorded:
            self._available[stamp] = {
                InputKind.TABLE_STATE: int(ack.table_state), InputKind.DEMONSTRATION: acts
            }  # fmt: skip
        elif ack.table_state:
            kinds = [InputKind.TABLE_STATE, *[InputKind.DEMONSTRATION] * acts]
            self._inputs.extend(SessionInput(kind, stamp) for kind in kinds)

    def ready(self) -> Iterator[SessionInput]:
        """Remove and yield the inputs that can be given now."""
        while self._inputs:
            item = self._inputs[0]
            if self._recorded and item.kind.has_topic:
                if item.stamp not in self._available and item.stamp > self._newest:
                    return
                if not self._use(item):
                    self.missed += item.kind is InputKind.DEMONSTRATION
                    self._inputs.popleft()
                    continue
            yield self._inputs.popleft()

    def finish(self) -> None:
        """Count what is left over at the end."""
        self.missed += len(self._inputs)
        self.unrecorded += sum(n[InputKind.DEMONSTRATION] for n in self._available.values())

    def _use(self, item: SessionInput) -> bool:
        available = self._available.get(item.stamp, {})
        if not available.get(item.kind):
            return False
        available[item.kind] -= 1
        for stamp in [stamp for stamp in self._available if stamp < item.stamp]:
            self.unrecorded += self._available.pop(stamp)[InputKind.DEMONSTRATION]
        return True


def run_replay(
    steps: Iterable[ReplayStep], recorded: bool, target: ReplayTarget,
    log: Callable[[LogEntry], None],
) -> ReplayCounts:  # fmt: skip
    """Replay all steps; `log` gets every event as soon as it is known.

    recorded: the steps hold the inputs of a live session.
    """
    scheduler, counts = InputScheduler(recorded), ReplayCounts()

    def log_all(entries: Iterable[LogEntry]) -> None:
        for entry in entries:
            counts.entries += 1
            log(entry)

    for step in steps:
        if isinstance(step, SessionInput):
            scheduler.add_input(step)
        else:
            ack = target.show_frame(step)
            counts.frames += 1
            counts.tables += ack.table_state
            if ack.rejection:
                counts.rejected += 1
                counts.first_rejection = counts.first_rejection or ack.rejection
            log_all(ack.demonstrations)
            scheduler.add_frame(step.stamp, ack)
        for item in scheduler.ready():
            log_all(target.apply_input(item))
    scheduler.finish()
    counts.missed, counts.unrecorded = scheduler.missed, scheduler.unrecorded
    counts.refused_inputs = target.refused_inputs
    return counts

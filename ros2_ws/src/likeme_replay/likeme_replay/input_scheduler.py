"""Playing a script on a stage, one thing after another: what makes every replay the same.

A stage shows frames to perception and gives cues to the session: the cores in this process, or
nodes behind a network that acknowledge everything. Nothing here knows a clock, and nothing is
begun before what came before it has ended.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from likeme_inference.input_sequencer import Cue, Input
from likeme_replay.decision_log import Entry
from likeme_replay.recorded_inputs import Frame, Step


class Done(NamedTuple):
    """What perception made of a frame; `refused`: why it was not read, or nothing."""

    table_state: bool
    demonstrations: tuple[Entry, ...] = ()
    refused: str = ''


class Stage(Protocol):
    """Where a script is played.

    misfits: what arm or operator said in the recorded run that made no sense here.
    """

    misfits: int

    def show(self, frame: Frame) -> Done:
        """Have perception read a frame; returns when it is done."""

    def hear(self, cue: Cue) -> list[Entry]:
        """Have the session take something in; what came of it, in order."""


@dataclass
class Tally:
    """What a performance came to.

    Attributes:
        frames, refused: shown, and of these not read; `reason`: why the first was not.
        entries: lines of the log.
        missed: demonstrations, or others' words, that the live session heard and this one did not.
        unheard: demonstrations seen here that the live session did not hear.
        misfits: what arm or operator said then that made no sense here.
        unpaired: images without a partner of their stamp; unread: frames not read in the live run;
            unreadable: messages that are not what their type says.
    """

    frames: int = 0
    refused: int = 0
    entries: int = 0
    missed: int = 0
    unheard: int = 0
    misfits: int = 0
    unpaired: int = 0
    unread: int = 0
    unreadable: int = 0
    reason: str = ''

    @property
    def remarks(self) -> list[str]:
        """What somebody who compares with the live run should know, in sentences."""
        said = {
            f'{self.refused} of {self.frames} frames were not read; the first because: '
            f'{self.reason}': self.refused,
            f'{self.missed} things the live session heard did not come about here.': self.missed,
            f'{self.unheard} demonstrations were seen here that the live session did not hear.':
                self.unheard,
            f"{self.misfits} answers of arm or operator did not fit here.": self.misfits,
            f'{self.unpaired} images have no partner of their stamp and were not shown.':
                self.unpaired,
            f'{self.unreadable} messages are not what their type says.': self.unreadable,
            f'{self.unread} frames were not read in the live run and not shown.': self.unread,
        }  # fmt: skip
        return [sentence for sentence, count in said.items() if count]


class Prompter:
    """Says which cue is next, so that none comes before what it speaks of.

    Without recorded cues every table state is one, and every demonstration after its table state.
    """

    def __init__(self, recorded: bool) -> None:
        self._recorded = recorded
        self._cues: deque[Cue] = deque()
        # What is there to be heard, by its stamp.
        self._there: dict[int, dict[Input, int]] = {}
        self._newest = -1
        self.missed = self.unheard = 0

    def cue(self, cue: Cue) -> None:
        """Take a recorded cue."""
        self._cues.append(cue)

    def shown(self, stamp: int, done: Done) -> None:
        """A frame is done with."""
        acts = len(done.demonstrations)
        self._newest = stamp
        if self._recorded:
            here = {Input.TABLE_STATE: int(done.table_state), Input.DEMONSTRATION: acts}
            self._there[stamp] = here
        elif done.table_state:
            kinds = [Input.TABLE_STATE, *[Input.DEMONSTRATION] * acts]
            self._cues.extend(Cue(kind, stamp, None) for kind in kinds)

    def due(self) -> Iterator[Cue]:
        """Cues that can be given now."""
        while self._cues:
            cue = self._cues[0]
            if self._recorded and cue.kind.comes_by_topic:
                if cue.stamp not in self._there and cue.stamp > self._newest:
                    return
                if not self._take(cue):
                    self.missed += cue.kind is Input.DEMONSTRATION
                    self._cues.popleft()
                    continue
            yield self._cues.popleft()

    def end(self) -> None:
        """Count what is left over."""
        self.missed += len(self._cues)
        self.unheard += sum(left[Input.DEMONSTRATION] for left in self._there.values())

    def _take(self, cue: Cue) -> bool:
        here = self._there.get(cue.stamp, {})
        if not here.get(cue.kind):
            return False
        here[cue.kind] -= 1
        older = [stamp for stamp in self._there if stamp < cue.stamp]
        for stamp in older:
            self.unheard += self._there.pop(stamp)[Input.DEMONSTRATION]
        return True


def perform(
    steps: Iterable[Step], live: bool, stage: Stage, tell: Callable[[Entry], None]
) -> Tally:
    """Play all steps; `tell` gets every event as soon as it is known."""
    prompter, tally = Prompter(live), Tally()

    def told(entries: Iterable[Entry]) -> None:
        for entry in entries:
            tally.entries += 1
            tell(entry)

    for step in steps:
        if isinstance(step, Cue):
            prompter.cue(step)
        else:
            done = stage.show(step)
            tally.frames += 1
            if done.refused:
                tally.refused += 1
                tally.reason = tally.reason or done.refused
            told(done.demonstrations)
            prompter.shown(step.stamp, done)
        for cue in prompter.due():
            told(stage.hear(cue))
    prompter.end()
    tally.missed, tally.unheard = prompter.missed, prompter.unheard
    return tally

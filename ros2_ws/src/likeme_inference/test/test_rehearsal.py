"""Inputs held back until their cue."""

from __future__ import annotations

from likeme_inference.input_sequencer import Cue, Input, Rehearsal


class Stage:
    """A rehearsal whose messages are (stamp, text)."""

    def __init__(self, on: bool) -> None:
        self.rehearsal = Rehearsal(on)
        self.taken: list[str] = []
        gates = {
            kind: self.rehearsal.gate(kind, lambda m: m[0], self.take, self.play)
            for kind in (Input.TABLE_STATE, Input.DEMONSTRATION)
        }
        self.see, self.watch = gates[Input.TABLE_STATE], gates[Input.DEMONSTRATION]

    def take(self, message: tuple[int, str]) -> None:
        self.taken.append(message[1])

    def play(self) -> None:
        for cue, message in self.rehearsal.ready():
            self.taken.append(message[1] if message else cue.kind.name)

    def cue(self, kind: Input, stamp: int = 0) -> None:
        self.rehearsal.add(Cue(kind, stamp, None))
        self.play()


def test_a_live_session_takes_everything_at_once() -> None:
    stage = Stage(on=False)
    stage.see((1, 'table'))
    stage.watch((1, 'act'))
    assert stage.taken == ['table', 'act']


def test_the_order_is_the_cues_whatever_comes_first() -> None:
    stage = Stage(on=True)
    stage.watch((1, 'act'))
    stage.see((1, 'table'))
    assert stage.taken == []
    stage.cue(Input.TABLE_STATE, 1)
    stage.cue(Input.MOTION)
    stage.cue(Input.DEMONSTRATION, 1)
    assert stage.taken == ['table', 'MOTION', 'act']


def test_a_cue_waits_for_its_message_and_holds_back_those_behind_it() -> None:
    stage = Stage(on=True)
    stage.cue(Input.DEMONSTRATION, 2)
    stage.cue(Input.ANSWER)
    assert stage.taken == []
    stage.watch((2, 'act'))
    assert stage.taken == ['act', 'ANSWER']


def test_two_acts_of_one_frame_keep_their_order() -> None:
    stage = Stage(on=True)
    stage.watch((1, 'first'))
    stage.watch((1, 'second'))
    stage.cue(Input.DEMONSTRATION, 1)
    stage.cue(Input.DEMONSTRATION, 1)
    assert stage.taken == ['first', 'second']


def test_what_gets_no_cue_is_never_taken_and_a_new_beginning_forgets_it() -> None:
    stage = Stage(on=True)
    stage.see((1, 'not heard in the recorded run'))
    stage.see((2, 'heard'))
    stage.cue(Input.TABLE_STATE, 2)
    stage.cue(Input.TABLE_STATE, 1)
    assert stage.taken == ['heard']
    stage.rehearsal.begin(on=True)
    stage.see((3, 'after'))
    stage.cue(Input.TABLE_STATE, 3)
    assert stage.taken == ['heard', 'after']

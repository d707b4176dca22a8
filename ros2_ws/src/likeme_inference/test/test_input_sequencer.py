"""Messages wait until their input is the next one of the recorded sequence."""

from __future__ import annotations

from likeme_inference.input_sequencer import InputSequencer
from likeme_inference.session_inputs import InputKind, SessionInput


class Applied:
    """A sequencer whose ready inputs are applied at once."""

    def __init__(self) -> None:
        self.sequencer = InputSequencer()
        self.applied: list[str] = []

    def message(self, kind: InputKind, stamp: int, text: str) -> None:
        self.sequencer.add_message(kind, stamp, text)
        self._apply()

    def input(self, kind: InputKind, stamp: int = 0) -> None:
        self.sequencer.add_input(SessionInput(kind, stamp))
        self._apply()

    def _apply(self) -> None:
        self.applied += [item.message or item.kind.name for item in self.sequencer.ready()]


def test_inputs_are_applied_in_their_order_whatever_arrives_first() -> None:
    session = Applied()
    session.message(InputKind.DEMONSTRATION, 1, 'act')
    session.message(InputKind.TABLE_STATE, 1, 'table')
    assert session.applied == []
    session.input(InputKind.TABLE_STATE, 1)
    session.input(InputKind.MOTION)
    session.input(InputKind.DEMONSTRATION, 1)
    assert session.applied == ['table', 'MOTION', 'act']


def test_an_input_waits_for_its_message_and_holds_back_later_ones() -> None:
    session = Applied()
    session.input(InputKind.DEMONSTRATION, 2)
    session.input(InputKind.ANSWER)
    assert session.applied == []
    session.message(InputKind.DEMONSTRATION, 2, 'act')
    assert session.applied == ['act', 'ANSWER']


def test_two_demonstrations_of_one_frame_keep_their_order() -> None:
    session = Applied()
    session.message(InputKind.DEMONSTRATION, 1, 'first')
    session.message(InputKind.DEMONSTRATION, 1, 'second')
    session.input(InputKind.DEMONSTRATION, 1)
    session.input(InputKind.DEMONSTRATION, 1)
    assert session.applied == ['first', 'second']


def test_a_message_without_an_input_is_never_applied() -> None:
    session = Applied()
    session.message(InputKind.TABLE_STATE, 1, 'not an input of the recorded run')
    session.message(InputKind.TABLE_STATE, 2, 'table')
    session.input(InputKind.TABLE_STATE, 2)
    session.input(InputKind.TABLE_STATE, 1)
    assert session.applied == ['table']

"""Who may answer what, and how often."""

from __future__ import annotations

import pytest

from likeme_core.tabletop import Action, State
from likeme_inference.help_requests import AnswerRefusedError, HelpDesk
from likeme_inference.tabletop.values import HelpRequest, Reply


def request(number: int) -> HelpRequest:
    return HelpRequest(
        0, '', number, 'pear', State.RIGHT, State.LEFT, Action.PUSH_LEFT, 0.4, 0.5, 'Will you?'
    )


@pytest.fixture
def desk() -> HelpDesk:
    desk = HelpDesk()
    desk.add(request(2))
    desk.add(request(5))
    return desk


def test_an_answer_takes_the_request_away(desk: HelpDesk) -> None:
    answer = desk.answer(2, Reply.SKIP, ' Ada ')

    assert (answer.request.id, answer.reply, answer.answered_by) == (2, Reply.SKIP, 'Ada')
    assert answer.sentence == 'Request 2 answered by Ada: SKIP.'
    assert [item.id for item in desk.pending] == [5]


def test_a_second_answer_is_refused(desk: HelpDesk) -> None:
    desk.answer(2, Reply.SKIP, 'Ada')

    with pytest.raises(AnswerRefusedError, match='2 was answered already: SKIP by Ada'):
        desk.answer(2, Reply.DONE_BY_HAND, 'Bob')


@pytest.mark.parametrize(
    ('number', 'reply', 'name', 'message'),
    [
        (7, 0, 'Ada', r'one of the pending requests \[2, 5\], got 7'),
        (2, 3, 'Ada', '0 DONE_BY_HAND, 1 TRY_ANYWAY, 2 SKIP, got 3'),
        (2, 0, '  ', 'Expected the name of who answers'),
    ],
)
def test_refused_answers_leave_the_request(
    desk: HelpDesk, number: int, reply: int, name: str, message: str
) -> None:
    with pytest.raises(AnswerRefusedError, match=message):
        desk.answer(number, reply, name)
    assert [item.id for item in desk.pending] == [2, 5]


def test_nothing_is_pending() -> None:
    with pytest.raises(AnswerRefusedError, match='Nothing is pending, got an answer to request 1'):
        HelpDesk().answer(1, Reply.SKIP, 'Ada')

"""Rules for answers to requests for help."""

from __future__ import annotations

import pytest

from likeme_core.paper_world import LEFT, PUSH_LEFT, RIGHT
from likeme_inference.help_requests import ANSWERS_KEPT, AnswerRefusedError, HelpRequests
from likeme_inference.tabletop.values import HelpRequest, Reply


def request(number: int) -> HelpRequest:
    return HelpRequest(0, '', number, 'pear', RIGHT, LEFT, PUSH_LEFT, 0.4, 0.5, 'Will you?')


@pytest.fixture
def requests() -> HelpRequests:
    requests = HelpRequests()
    requests.add(request(2))
    requests.add(request(5))
    return requests


def test_an_answered_request_is_no_longer_pending(requests: HelpRequests) -> None:
    answer = requests.answer(2, Reply.SKIP, ' Ada ')

    assert (answer.request.id, answer.reply, answer.answered_by) == (2, Reply.SKIP, 'Ada')
    assert answer.sentence == 'Request 2 answered by Ada: SKIP.'
    assert [item.id for item in requests.pending] == [5]


def test_a_second_answer_is_refused(requests: HelpRequests) -> None:
    requests.answer(2, Reply.SKIP, 'Ada')

    with pytest.raises(AnswerRefusedError, match='2 was answered already: SKIP by Ada'):
        requests.answer(2, Reply.DONE_BY_HAND, 'Bob')


@pytest.mark.parametrize(
    ('number', 'reply', 'name', 'message'),
    [
        (7, 0, 'Ada', r'one of the pending requests \[2, 5\], got 7'),
        (2, 3, 'Ada', '0 DONE_BY_HAND, 1 TRY_ANYWAY, 2 SKIP, got 3'),
        (2, 0, '  ', 'Expected the name of the operator'),
    ],
)
def test_refused_answers_leave_the_request(
    requests: HelpRequests, number: int, reply: int, name: str, message: str
) -> None:
    with pytest.raises(AnswerRefusedError, match=message):
        requests.answer(number, reply, name)
    assert [item.id for item in requests.pending] == [2, 5]


def test_nothing_is_pending() -> None:
    with pytest.raises(AnswerRefusedError, match='Nothing is pending, got an answer to request 1'):
        HelpRequests().answer(1, Reply.SKIP, 'Ada')


def test_only_the_last_answers_are_remembered() -> None:
    requests = HelpRequests()
    for number in range(1, 2 * ANSWERS_KEPT + 1):
        requests.add(request(number))
        requests.answer(number, Reply.SKIP, 'Ada')
    requests.add(request(9999))

    with pytest.raises(AnswerRefusedError, match='was answered already'):
        requests.answer(ANSWERS_KEPT + 1, Reply.SKIP, 'Bob')
    with pytest.raises(AnswerRefusedError, match=f'got {ANSWERS_KEPT}'):
        requests.answer(ANSWERS_KEPT, Reply.SKIP, 'Bob')

"""Rules for answers to requests for help."""

from __future__ import annotations

from dataclasses import replace

import pytest

from likeme_core.paper_world import LEFT, PUSH_LEFT, RIGHT
from likeme_inference.help_requests import (
    ANSWERS_KEPT,
    AnswerRefusedError,
    HelpRequests,
    ReadQuestion,
)
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
    answer = requests.check(2, Reply.SKIP, ' Ada ', ReadQuestion('PEAR', 'push_left', 0))
    requests.accept(answer)

    assert (answer.request.id, answer.reply, answer.answered_by) == (2, Reply.SKIP, 'Ada')
    assert answer.sentence == (
        'Request 2, pear: skipped, push_left is not tried (answered by Ada).'
    )
    assert [item.id for item in requests.pending] == [5]


def test_a_second_answer_is_refused(requests: HelpRequests) -> None:
    requests.accept(requests.check(2, Reply.SKIP, 'Ada'))

    with pytest.raises(AnswerRefusedError, match='2 was answered already: SKIP by Ada'):
        requests.check(2, Reply.DONE_BY_HAND, 'Bob')


def test_a_repeated_answer_is_known(requests: HelpRequests) -> None:
    read = ReadQuestion('pear', 'push_left', 0)
    first = requests.check(2, Reply.SKIP, 'Ada', read)
    assert requests.accepted(2, Reply.SKIP, 'Ada', read) is None
    requests.accept(first)

    assert requests.accepted(2, Reply.SKIP, ' Ada', read) is first
    assert requests.accepted(2, Reply.SKIP, 'Bob', read) is None
    assert requests.accepted(2, Reply.TRY_ANYWAY, 'Ada', read) is None
    assert requests.accepted(2, Reply.SKIP, 'Ada', read._replace(stamp=1)) is None


@pytest.mark.parametrize(
    ('number', 'reply', 'name', 'message'),
    [
        (7, 0, 'Ada', r'one of the pending requests \[2, 5\], got 7'),
        (2, 7, 'Ada', '0 DONE_BY_HAND, 1 TRY_ANYWAY, 2 SKIP, 3 NAME_GOAL, got 7'),
        (2, 3, 'Ada', 'Expected a goal with NAME_GOAL alone, got none'),
        (2, 0, '  ', 'Expected the name of the operator'),
    ],
)
def test_refused_answers_leave_the_request(
    requests: HelpRequests, number: int, reply: int, name: str, message: str
) -> None:
    with pytest.raises(AnswerRefusedError, match=message):
        requests.check(number, reply, name)
    assert [item.id for item in requests.pending] == [2, 5]


@pytest.mark.parametrize(
    'read',
    [
        ReadQuestion('chicken', 'push_left', 0),
        ReadQuestion('pear', 'push_right', 0),
        ReadQuestion('pear', 'push_left', 1),
        ReadQuestion('', '', 0),
    ],
)
def test_an_answer_to_another_question_is_refused(
    requests: HelpRequests, read: ReadQuestion
) -> None:
    expected = r'open request 2 \(pear, push_left, of 0.000 s\), got one to '
    with pytest.raises(AnswerRefusedError, match=expected + str(read)):
        requests.check(2, Reply.TRY_ANYWAY, 'Ada', read)


@pytest.mark.parametrize(
    ('reply', 'follows'),
    [
        (Reply.TRY_ANYWAY, 'Request 5, pear: the robot tries push_left (answered by Ada).'),
        (Reply.DONE_BY_HAND, 'the robot looks whether it is LEFT'),
    ],
)
def test_the_confirmation_says_what_follows(
    requests: HelpRequests, reply: Reply, follows: str
) -> None:
    assert follows in requests.check(5, reply, 'Ada').sentence


def test_nothing_is_pending() -> None:
    with pytest.raises(AnswerRefusedError, match='Nothing is pending, got an answer to request 1'):
        HelpRequests().check(1, Reply.SKIP, 'Ada')


def test_only_the_last_answers_are_remembered() -> None:
    requests = HelpRequests()
    for number in range(1, 2 * ANSWERS_KEPT + 1):
        requests.add(request(number))
        requests.accept(requests.check(number, Reply.SKIP, 'Ada'))
    requests.add(request(9999))

    with pytest.raises(AnswerRefusedError, match='was answered already'):
        requests.check(ANSWERS_KEPT + 1, Reply.SKIP, 'Bob')
    with pytest.raises(AnswerRefusedError, match=f'got {ANSWERS_KEPT}'):
        requests.check(ANSWERS_KEPT, Reply.SKIP, 'Bob')


def test_an_answer_may_name_the_goal(requests: HelpRequests) -> None:
    answer = requests.check(2, Reply.NAME_GOAL, 'Ada', goal=RIGHT)

    assert answer.sentence == (
        'Request 2, pear: wanted RIGHT, the robot decides anew (answered by Ada).'
    )
    with pytest.raises(AnswerRefusedError, match='got RIGHT with SKIP'):
        requests.check(2, Reply.SKIP, 'Ada', goal=RIGHT)


def test_what_never_worked_is_not_tried() -> None:
    requests = HelpRequests()
    requests.add(replace(request(2), predicted_success=0.0))
    with pytest.raises(AnswerRefusedError, match='Expected DONE_BY_HAND or SKIP or NAME_GOAL for'):
        requests.check(2, Reply.TRY_ANYWAY, 'Ada')
    assert requests.check(2, Reply.SKIP, 'Ada').reply is Reply.SKIP

"""Pending and answered requests for help: the logic of the ask_human service."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

from likeme_core.stamps import SECOND
from likeme_core.tabletop import State
from likeme_inference.tabletop.values import HelpRequest, Reply

#: Accepted answers that are remembered: for a second operator who answers late, not for the
#: lifetime of the node.
ANSWERS_KEPT = 100


class AnswerRefusedError(ValueError):
    """An answer that cannot be accepted."""


@dataclass(frozen=True)
class AcceptedAnswer:
    """An accepted answer."""

    request: HelpRequest
    reply: Reply
    answered_by: str
    goal: State | None = field(default=None, metadata={'added': True})

    @property
    def sentence(self) -> str:
        """What the answer leads to, and who gave it."""
        request = self.request
        named = '' if self.goal is None else self.goal.name
        follows = {
            Reply.DONE_BY_HAND: f'done by hand, the robot looks whether it is {request.goal.name}',
            Reply.TRY_ANYWAY: f'the robot tries {request.action.name.lower()}',
            Reply.SKIP: f'skipped, {request.action.name.lower()} is not tried',
            Reply.NAME_GOAL: f'wanted {named}, the robot decides anew',
        }
        about = f'Request {request.id}, {request.object}'
        return f'{about}: {follows[self.reply]} (answered by {self.answered_by}).'


class ReadQuestion(NamedTuple):
    """What was read by whoever answers: object and action by their names, stamp in ns."""

    object: str
    action: str
    stamp: int

    def __str__(self) -> str:
        names = f'{self.object or "no object"}, {self.action.lower() or "no action"}'
        return f'{names}, of {self.stamp / SECOND:.3f} s'

    def fits(self, request: HelpRequest) -> bool:
        """Whether it is what the request asks; names in any case."""
        there = question_of(request)
        names = (self.object.casefold(), self.action.casefold())
        known = (there.object.casefold(), there.action.casefold())
        return names == known and self.stamp == there.stamp


def question_of(request: HelpRequest) -> ReadQuestion:
    """What there is to read in a request."""
    return ReadQuestion(request.object, request.action.name, request.stamp)


class HelpRequests:
    """Pending requests, and the latest accepted answers."""

    def __init__(self) -> None:
        self._pending: dict[int, HelpRequest] = {}
        self._answered: dict[int, AcceptedAnswer] = {}

    @property
    def pending(self) -> tuple[HelpRequest, ...]:
        """Requests without an answer, oldest first."""
        return tuple(self._pending.values())

    def add(self, request: HelpRequest) -> None:
        """Add a pending request."""
        self._pending[request.id] = request

    def accepted(
        self,
        request_id: int,
        reply: int,
        answered_by: str,
        read: ReadQuestion | None = None,
        goal: State | None = None,
    ) -> AcceptedAnswer | None:
        """The same answer, if it was accepted before; who gets no response repeats it."""
        before = self._answered.get(request_id)
        given = (reply, answered_by.strip(), goal)
        if before is None or given != (before.reply, before.answered_by, before.goal):
            return None
        return before if read is None or read.fits(before.request) else None

    def check(
        self,
        request_id: int,
        reply: int,
        answered_by: str,
        read: ReadQuestion | None = None,
        goal: State | None = None,
    ) -> AcceptedAnswer:
        """The answer, if it can be accepted.

        read: what it is given to, None: not compared. goal: that it names.

        Raises:
            AnswerRefusedError: a second answer, nothing pending, an unknown request, another
                question than was read, a number that is no Reply or not one of the request's
                options, a goal without NAME_GOAL or none with it, or an empty name.
        """
        if request_id in self._answered:
            before = self._answered[request_id]
            raise AnswerRefusedError(
                f'Request {request_id} was answered already: {before.reply.name} '
                f'by {before.answered_by}.'
            )
        if not self._pending:
            raise AnswerRefusedError(f'Nothing is pending, got an answer to request {request_id}.')
        if request_id not in self._pending:
            raise AnswerRefusedError(
                f'Expected one of the pending requests {list(self._pending)}, got {request_id}.'
            )
        request = self._pending[request_id]
        if read is not None and not read.fits(request):
            raise AnswerRefusedError(
                f'Expected an answer to the open request {request_id} ({question_of(request)}), '
                f'got one to {read}.'
            )
        if reply not in set(Reply):
            known = ', '.join(f'{r.value} {r.name}' for r in Reply)
            raise AnswerRefusedError(f'Expected an answer out of {known}, got {reply}.')
        if reply not in request.options:
            options = ' or '.join(option.name for option in request.options)
            raise AnswerRefusedError(
                f'Expected {options} for request {request_id}, got {Reply(reply).name}: no action '
                f'of the robot gets the {request.object} from {request.x_i.name} to '
                f'{request.goal.name}.'
            )
        if (reply == Reply.NAME_GOAL) != (goal is not None):
            got = 'none' if goal is None else f'{goal.name} with {Reply(reply).name}'
            raise AnswerRefusedError(f'Expected a goal with NAME_GOAL alone, got {got}.')
        if not answered_by.strip():
            raise AnswerRefusedError('Expected the name of the operator, got an empty one.')
        return AcceptedAnswer(request, Reply(reply), answered_by.strip(), goal)

    def accept(self, answer: AcceptedAnswer) -> None:
        """Take an answer; its request is no longer pending."""
        self._pending.pop(answer.request.id, None)
        if len(self._answered) == ANSWERS_KEPT:
            self._answered.pop(next(iter(self._answered)))
        self._answered[answer.request.id] = answer

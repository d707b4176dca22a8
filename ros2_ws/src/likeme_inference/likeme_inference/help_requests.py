"""Pending and answered requests for help: the logic of the ask_human service."""

from __future__ import annotations

from dataclasses import dataclass

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

    @property
    def sentence(self) -> str:
        """Log message of the accepted answer."""
        return f'Request {self.request.id} answered by {self.answered_by}: {self.reply.name}.'


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

    def answer(self, request_id: int, reply: int, answered_by: str) -> AcceptedAnswer:
        """Accept an answer; the request is no longer pending.

        Raises:
            AnswerRefusedError: a second answer, nothing pending, an unknown request, a number that
                is not a Reply, or an empty name.
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
        if reply not in set(Reply):
            known = ', '.join(f'{r.value} {r.name}' for r in Reply)
            raise AnswerRefusedError(f'Expected an answer out of {known}, got {reply}.')
        if not answered_by.strip():
            raise AnswerRefusedError('Expected the name of the operator, got an empty one.')
        answer = AcceptedAnswer(self._pending.pop(request_id), Reply(reply), answered_by.strip())
        if len(self._answered) == ANSWERS_KEPT:
            self._answered.pop(next(iter(self._answered)))
        self._answered[request_id] = answer
        return answer

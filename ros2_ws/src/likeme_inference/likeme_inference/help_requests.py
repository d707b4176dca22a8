"""Requests for help and the rules of answering them: the core of the ask_human service."""

from __future__ import annotations

from dataclasses import dataclass

from likeme_inference.tabletop.values import HelpRequest, Reply


class AnswerRefusedError(ValueError):
    """An answer that cannot be accepted, in one sentence."""


@dataclass(frozen=True)
class Answer:
    """An accepted answer."""

    request: HelpRequest
    reply: Reply
    answered_by: str

    @property
    def sentence(self) -> str:
        """What was accepted."""
        return f'Request {self.request.id} answered by {self.answered_by}: {self.reply.name}.'


class HelpDesk:
    """Keeps the questions that wait for an answer, and remembers those that had one."""

    def __init__(self) -> None:
        self._pending: dict[int, HelpRequest] = {}
        self._answered: dict[int, Answer] = {}

    @property
    def pending(self) -> tuple[HelpRequest, ...]:
        """Requests that wait for an answer, oldest first."""
        return tuple(self._pending.values())

    def add(self, request: HelpRequest) -> None:
        """Put up a question."""
        self._pending[request.id] = request

    def answer(self, request_id: int, reply: int, answered_by: str) -> Answer:
        """Accept an answer; the request is no longer pending.

        Raises:
            AnswerRefusedError: second answer, nothing pending, unknown request, an answer that
                is no Reply, or nobody's name to it.
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
            raise AnswerRefusedError('Expected the name of who answers, got an empty one.')
        answer = Answer(self._pending.pop(request_id), Reply(reply), answered_by.strip())
        self._answered[request_id] = answer
        return answer

"""What waits for Enter, and which questions were read before a key was pressed.

Times are s of the monotonic clock, as those of Textual's keys.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from likeme_inference.tabletop.values import Reply
from likeme_operator.desk_view import MadeDecision, OpenQuestion, QuestionKey

#: s for which a question, or what Enter would do, has to be on the screen before a key counts.
READING_TIME = 0.4
#: s in which Enter has to be pressed; nothing moves without it.
ENTER_TIME = 15.0


@dataclass(frozen=True)
class Confirmation:
    """An act that Enter carries out.

    Attributes:
        sentences: what it does.
        since: when it was chosen.
        key: the question that is answered, None: motion is resumed.
        reply: the answer.
        goal: the region that it names.
    """

    sentences: tuple[str, ...]
    since: float
    key: QuestionKey | None = None
    reply: Reply | None = None
    goal: str = ''

    @classmethod
    def of_answer(
        cls,
        question: OpenQuestion,
        reply: Reply,
        decision: MadeDecision | None,
        now: float,
        goal: str = '',
    ) -> Confirmation:
        """An answer to a question; decision: that asks, for what its action leads to."""
        key = question.key
        follows = {
            Reply.DONE_BY_HAND: f'the robot looks whether the {key.object} is {question.goal}.',
            Reply.TRY_ANYWAY: f'THE ARM MOVES: {key.action} {key.object}.',
            Reply.SKIP: 'nothing moves.',
            Reply.NAME_GOAL: f'the {key.object} is wanted {goal}; THE ARM MAY MOVE it there.',
        }
        expected = ''
        if reply is Reply.TRY_ANYWAY and decision is not None and decision.id == key.id:
            ends = ', '.join(f'{name} {p:.2f}' for name, p in decision.predicted if p > 0)
            expected = f'It ends there with p: {ends}.'
        word = reply.name.replace('_', ' ')
        said = f'{word}, question {key.id}: {follows[reply]}'
        return cls((said, expected), now, key, reply, goal)

    @classmethod
    def of_resume(cls, sentences: Sequence[str], now: float) -> Confirmation:
        """Motion is allowed again."""
        return cls((f'RESUME: {sentences[0]}', ' '.join(sentences[1:])), now)

    def left(self, now: float) -> float:
        """Time in which Enter has to come."""
        return ENTER_TIME - (now - self.since)

    def was_read(self, pressed: float) -> bool:
        """Whether a key that was pressed then can have been meant for it."""
        return pressed - self.since > READING_TIME

    def lines(self, now: float) -> tuple[str, ...]:
        """What stands on the screen."""
        left = max(0, round(self.left(now)))
        return (*self.sentences, f'Enter does it, any other key cancels; cancelled in {left} s.')


class Readings:
    """When each open question came to the screen."""

    def __init__(self) -> None:
        self._shown: dict[QuestionKey, float | None] = {}
        self._skipped: set[QuestionKey] = set()

    def keep(self, keys: Sequence[QuestionKey]) -> list[QuestionKey]:
        """Forget the questions that are not open any more; those that are new."""
        new = [key for key in keys if key not in self._shown]
        self._shown = {key: self._shown.get(key) for key in keys}
        return new

    def shown(self, now: Callable[[], float]) -> None:
        """The screen has been drawn with all of them."""
        at = now()
        self._shown = {key: at if then is None else then for key, then in self._shown.items()}

    def was_read(self, key: QuestionKey, pressed: float) -> bool:
        """Whether a question was on the screen for a while when a key was pressed."""
        then = self._shown.get(key)
        return then is not None and pressed - then > READING_TIME

    def skip_once(self, key: QuestionKey) -> bool:
        """Whether a question is to be skipped now; true once."""
        first = key not in self._skipped
        self._skipped.add(key)
        return first

"""The whole screen of the desk as lines of text."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass

from likeme_core.world import World
from likeme_operator.desk_view import DeskView, OpenQuestion
from likeme_operator.panels import (
    KEYS,
    alarm_line,
    belief_lines,
    header_line,
    history_lines,
    option_lines,
    table_lines,
    what_if_lines,
    why_lines,
)
from likeme_operator.what_if import Alternative

#: Least columns and lines.
LEAST = (80, 24)
#: Lines of the options, and of the parts above them at the least height.
OPTIONS, WHAT_IF, MIDDLE = 3, 2, 9


@dataclass(frozen=True)
class DeskState:
    """What an operator has chosen at this desk.

    Attributes:
        question: the one that keys answer.
        selected: decision that is looked at; None: the newest one.
        supposed, modes: of what-if.
        confirming: lines that wait for Enter; empty: none do.
        remark: the newest sentence.
    """

    question: OpenQuestion | None = None
    selected: int | None = None
    supposed: Alternative | None = None
    modes: Sequence[Alternative] = ()
    confirming: tuple[str, ...] = ()
    remark: str = ''


def too_small(width: int, height: int) -> str:
    """The sentence for a terminal that is too small; empty: it is not."""
    if width >= LEAST[0] and height >= LEAST[1]:
        return ''
    return f'Expected a terminal of {LEAST[0]}x{LEAST[1]} or more, got {width}x{height}.'


def desk_lines(
    view: DeskView, world: World | None, state: DeskState, clock: str, width: int, height: int
) -> list[str]:
    """The screen: exactly `height` lines of at most `width` characters."""
    extra = height - LEAST[1]
    middle, history = MIDDLE + extra // 2, 2 + extra - extra // 2
    left = 34 + (width - LEAST[0]) // 2
    right = width - left - 2
    waiting = [part for line in state.confirming for part in textwrap.wrap(line, width)]
    # What Enter would do is never cut: it takes lines of the history.
    options = max(OPTIONS, len(waiting))
    history -= options - OPTIONS
    plan = _fill(table_lines(view, world, left, middle), middle)
    decision, acting = view.decision, None if state.selected is not None else view.acting
    what = f'why: {"the newest" if state.selected is None else "a past"} decision'
    if acting is None:
        why = why_lines(view, right, middle)
    else:
        why, what = belief_lines(acting, view.attempted, right, middle), 'what is wanted'
    rows = [
        header_line(view, clock, width),
        alarm_line(view, state.question, width),
        _title('sees', left) + '┬' + _title(what, width - left - 1),
        *(f'{a:{left}.{left}}│ {b}' for a, b in zip(plan, _fill(why, middle), strict=True)),
        _title('what if (changes nothing)', left) + '┴' + '─' * (width - left - 1),
        *_fill(what_if_lines(state.supposed, state.modes, width), WHAT_IF),
        _title('history', width),
        *_fill(history_lines(view, decision.id if decision else None, width, history), history),
        _title(_question_title(state), width),
        *_fill(waiting or option_lines(state.question, decision), options),
        f'» {state.remark}' if state.remark else '',
        KEYS,
    ]

    return [row[:width] for row in rows]


def _question_title(state: DeskState) -> str:
    if state.confirming:
        return 'Enter?'
    if state.question is None:
        return 'questions'
    return f'answer question {state.question.key.id}, {state.question.key.object}'


def _title(text: str, width: int) -> str:
    return f'── {text} '.ljust(width, '─')[:width]


def _fill(lines: list[str], height: int) -> list[str]:
    return [*lines[:height], *[''] * (height - len(lines))]

"""The desk as a full-screen terminal program."""

from __future__ import annotations

import asyncio
import signal
import threading
import time
from collections.abc import Callable
from datetime import datetime
from functools import partial
from typing import ClassVar

from rich.text import Text
from textual import events
from textual.app import App, ComposeResult
from textual.binding import Binding, BindingType
from textual.widgets import Static

from likeme_arm.ros.stop_command import CONFIRMATION_TIMEOUT
from likeme_core.tabletop import Mode
from likeme_inference.tabletop.values import Reply
from likeme_operator.desk_layout import DeskState, desk_lines, too_small
from likeme_operator.desk_node import DeskNode
from likeme_operator.desk_view import DeskView, OpenQuestion, QuestionKey
from likeme_operator.operator_node import ServiceAbsentError
from likeme_operator.panels import belief_page, history_lines
from likeme_operator.resume_notice import NOTHING, resume_notice
from likeme_operator.screen.confirmation import Confirmation, Readings
from likeme_operator.screen.pages import HELP, Page, health_lines, why_page
from likeme_operator.what_if import Alternative, WhatIf

#: s between two looks at what was heard.
PERIOD = 0.2
#: s in which nodes that were not heard yet ring no bell.
DISCOVERY = 4.0
#: Step of what-if's threshold.
STEP = 0.05
REPLY_KEYS = {'d': Reply.DONE_BY_HAND, 't': Reply.TRY_ANYWAY, 's': Reply.SKIP}
GOAL_KEY = 'g'
#: s for which a remark stays.
REMARK_TIME = 60.0
STYLES = (
    (r'ALARM.*|HELD.*|NOT CONFIRMED.*|STOPPED.*|NO CELL', 'bold white on red'),
    (r'ASKS|ASKING|MOVING [^ ]+ [^ ]+', 'bold yellow'),
    (r'ACTS|REACHED|MOTION ALLOWED|no alarm', 'bold green'),
    (r'UNKNOWN|MISSED|ARM_FAILED|NOT_SEEN', 'bold magenta'),
    (r'^» .*', 'bold'),
    (r'^(TRY ANYWAY|DONE BY HAND|SKIP|NAME GOAL|RESUME)[,:].*', 'bold'),
    (r'THE ARM (MOVES|MAY MOVE)|^Enter does it', 'bold black on yellow'),
    (r'^── .*|[│┴┬─]', 'dim'),
)


class DeskApp(App[int]):
    """Shows a DeskNode's view and turns keys into answers, holds and resumes."""

    ENABLE_COMMAND_PALETTE = False
    CSS = 'Screen { background: black; color: white; } Static { width: 100%; height: 100%; }'
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding('space', 'hold', priority=True),
        Binding('ctrl+c', 'leave', priority=True),
        Binding('q', 'leave', priority=True),
    ]

    def __init__(self, node: DeskNode, skip_after: float = 0.0) -> None:
        """skip_after: s after which an unanswered question is skipped; 0: never."""
        super().__init__()
        self._node, self._skip_after = node, skip_after
        self._view: DeskView = node.view()
        self._readings = Readings()
        self._confirmation: Confirmation | None = None
        # The question for which the next key names a goal.
        self._naming: QuestionKey | None = None
        self._chosen: int = 0
        self._selected: int | None = None
        self._threshold: float | None = None
        self._mode: Mode | None = None
        self._what_if: tuple[int, WhatIf | None] = (0, None)
        self._problems: tuple[str, ...] = ()
        self._opened = time.monotonic()

    def compose(self) -> ComposeResult:
        """One widget."""
        yield Static(id='desk', markup=False)

    def on_mount(self) -> None:
        """Begin to look; end by SIGTERM and SIGHUP as by `q`."""
        loop = asyncio.get_running_loop()
        for number in (signal.SIGTERM, signal.SIGHUP):
            loop.add_signal_handler(number, self.action_leave)
        self.set_interval(PERIOD, self.look)
        self.look()

    def on_resize(self, _: events.Resize) -> None:
        """Draw anew."""
        self.draw()

    def action_leave(self) -> None:
        """End; nothing of the cell changes."""
        self.exit(0)

    def action_hold(self) -> None:
        """Stop every motion at once, and see to it that the keeper confirms it.

        In a terminal the process that sees the keys has sent it already.
        """
        self._node.send_stop(self._node.by)
        self._confirmation = self._naming = None
        self._later(self._confirm_hold)

    def _confirm_hold(self) -> None:
        delay = self._node.stop(self._node.by)
        if delay is None:
            self._node.remark(
                f'NOT CONFIRMED within {CONFIRMATION_TIMEOUT:g} s: STOP was sent, and nobody '
                'says that motion is held. Use the hardware stop.'
            )
            self.call_from_thread(self.bell)

    def on_key(self, event: events.Key) -> None:
        """All keys but those that work everywhere."""
        if isinstance(self.screen, Page):
            return
        key = event.character or event.key
        if self._confirmation is not None:
            self._key_of_confirmation(event)
        elif self._naming is not None:
            self._name_goal(key, event.time)
        elif key in REPLY_KEYS:
            self._choose_reply(REPLY_KEYS[key], event.time)
        elif key == GOAL_KEY and self.question is not None:
            self._naming = self.question.key
            named = '  '.join(f'{n} {name}' for n, name in enumerate(self.question.regions, 1))
            self._node.remark(f'Which goal? {named}   Any other key cancels.')
        elif key == 'r':
            self._confirm_resume()
        elif key in ',.' or key in '<>':
            self._change_threshold(-STEP if key in ',<' else STEP)
        elif key == 'm':
            self._next_mode()
        elif event.key in ('up', 'down'):
            self._select(-1 if event.key == 'up' else 1)
        elif event.key == 'escape':
            self._selected = self._threshold = self._mode = None
        elif key.isdigit() and 0 < int(key) <= len(self._view.questions):
            self._chosen = int(key) - 1
        else:
            self._open_page(key)
        self.look()

    def look(self) -> None:
        """Take what was heard, tell what is new, and draw."""
        self._view = self._node.view(self._selected)
        now = time.monotonic()
        keys = [question.key for question in self._view.questions]
        for new in self._readings.keep(keys):
            self._node.remark(f'The robot asks: question {new.id}, {new.object}.')
            self.bell()
        fresh = set(self._view.problems) - set(self._problems)
        self._problems = self._view.problems
        if fresh and now - self._opened > DISCOVERY:
            self.bell()
        self._check_confirmation(now)
        if self._skip_after:
            self._skip_late_questions()
        self.draw()
        self.call_after_refresh(self._readings.shown, time.monotonic)

    def draw(self) -> None:
        """Write the screen."""
        width, height = self.size
        desk = self.query_one('#desk', Static)
        if sentence := too_small(width, height):
            desk.update(Text(sentence + ' SPACE still holds, q quits.'))
            return
        lines = desk_lines(
            self._view, self._node.geometry, self._state(), f'{datetime.now():%H:%M:%S}',
            width, height,
        )  # fmt: skip
        text = Text('\n'.join(lines), no_wrap=True)
        for pattern, style in STYLES:
            text.highlight_regex(f'(?m){pattern}', style)
        desk.update(text)

    @property
    def question(self) -> OpenQuestion | None:
        """The open question that keys answer."""
        asked = self._view.questions
        return asked[min(self._chosen, len(asked) - 1)] if asked else None

    def _state(self) -> DeskState:
        supposed, modes = self._suppose()
        now, remark = time.monotonic(), ''
        if self._node.remarks and now - self._node.remarks[-1][0] < REMARK_TIME:
            remark = self._node.remarks[-1][1]
        waiting = self._confirmation
        return DeskState(
            self.question,
            self._selected,
            supposed,
            modes,
            () if waiting is None else waiting.lines(now),
            remark,
        )

    def _suppose(self) -> tuple[Alternative | None, list[Alternative]]:
        decision = self._view.decision
        record = None if decision is None else self._node.records.get(decision.id)
        if decision is None or record is None:
            return None, []
        if self._what_if[0] != decision.id:
            try:
                self._what_if = decision.id, WhatIf(record)
            except (KeyError, ValueError, TypeError):
                self._what_if = decision.id, None
        question = self._what_if[1]
        if question is None:
            return None, []
        return question.under(self._mode, self._threshold), question.modes(self._threshold)

    def _change_threshold(self, step: float) -> None:
        supposed, _ = self._suppose()
        if supposed is not None:
            self._threshold = min(1.0, max(0.0, round(supposed.threshold + step, 2)))

    def _next_mode(self) -> None:
        supposed, _ = self._suppose()
        if supposed is not None:
            modes = list(Mode)
            self._mode = modes[(modes.index(supposed.mode) + 1) % len(modes)]

    def _select(self, step: int) -> None:
        """Look at an earlier or later decision of those that were heard."""
        numbers = [row.id for row in self._view.history if row.id in self._node.records]
        if not numbers:
            return
        at = numbers.index(self._selected) if self._selected in numbers else len(numbers)
        at = max(0, at + step)
        self._selected = numbers[at] if at < len(numbers) else None

    def _name_goal(self, key: str, typed: float) -> None:
        about, question = self._naming, self.question
        self._naming = None
        regions = () if question is None or question.key != about else question.regions
        if key.isdigit() and 0 < int(key) <= len(regions):
            self._choose_reply(Reply.NAME_GOAL, typed, regions[int(key) - 1])
        else:
            self._node.remark('Cancelled: nothing was sent.')

    def _choose_reply(self, reply: Reply, typed: float, goal: str = '') -> None:
        question = self.question
        if question is None:
            self._node.remark('Nothing is asked.')
        elif not self._readings.was_read(question.key, typed):
            self._node.remark('What was typed before this question is not taken as its answer.')
        elif reply not in question.options:
            self._node.remark(f'{reply.name} cannot work here: see the options.')
        elif inference_silent(self._view):
            self._node.remark('The inference node is not heard: no answer is taken now.')
        else:
            self._confirmation = Confirmation.of_answer(
                question, reply, self._view.decision, time.monotonic(), goal
            )

    def _confirm_resume(self) -> None:
        view = self._view
        if self._node.hold_state is None:
            self._node.remark('The hold keeper is not heard: nothing can be resumed.')
            return
        sentences = resume_notice(
            not view.motion.allowed,
            view.table.hand if view.table else None,
            view.table.arm if view.table else None,
            len(view.questions),
            view.decision.object if view.decision and view.decision.kind == 'AT_GOAL' else '',
        )
        if sentences == [NOTHING]:
            self._node.remark(NOTHING)
        else:
            self._confirmation = Confirmation.of_resume(sentences, time.monotonic())

    def _key_of_confirmation(self, event: events.Key) -> None:
        waiting = self._confirmation
        assert waiting is not None, 'Only called while something waits for Enter.'
        if event.key == 'enter' and waiting.was_read(event.time):
            self._confirmation = None
            self._later(partial(self._carry_out, waiting))
        elif event.key != 'enter':
            self._confirmation = None
            self._node.remark('Cancelled: nothing was sent.')

    def _carry_out(self, waiting: Confirmation) -> None:
        try:
            if waiting.key is None or waiting.reply is None:
                response = self._node.resume()
            else:
                response = self._node.answer(waiting.key, waiting.reply, waiting.goal)
            self._node.remark(response.message)
        except ServiceAbsentError as error:
            self._node.remark(str(error))

    def _check_confirmation(self, now: float) -> None:
        waiting = self._confirmation
        if waiting is None:
            return
        open_keys = [question.key for question in self._view.questions]
        if waiting.key is not None and inference_silent(self._view):
            self._node.remark('The inference node is not heard any more: nothing was sent.')
        elif waiting.key is not None and waiting.key not in open_keys:
            last = self._node.remarks[-1][1] if self._node.remarks else ''
            gone = last if 'was answered by' in last else 'It is not open any more.'
            self._node.remark(f'Nothing was sent for question {waiting.key.id}. {gone}')
        elif waiting.left(now) <= 0:
            self._node.remark('Nobody pressed Enter in time: nothing was sent, nothing moves.')
        else:
            return
        self._confirmation = None
        self.bell()

    def _skip_late_questions(self) -> None:
        """Answer `skip` to what nobody has answered in time."""
        for question in self._view.questions:
            if question.age > self._skip_after and self._readings.skip_once(question.key):
                waiting = Confirmation.of_answer(question, Reply.SKIP, None, time.monotonic())
                self._later(partial(self._carry_out, waiting))

    def _open_page(self, key: str) -> None:
        view = self._view
        if key == '?':
            self.push_screen(Page('Keys', lambda: HELP))
        elif key == 'h':
            rows = len(view.history) or 1
            self.push_screen(
                Page('History', lambda: history_lines(self._node.view(), None, 120, rows))
            )
        elif key == 'j':
            title = 'Wanted of the whole table'
            self.push_screen(Page(title, lambda: belief_page(self._node.view().believed)))
        elif key == 'n':
            self.push_screen(Page('Health', lambda: health_lines(self._node.view())))
        elif key == 'w' and view.decision is not None:
            decision = view.decision
            self.push_screen(Page(f'Why decision {decision.id}', lambda: why_page(decision)))
        elif key == 'l':
            said = [sentence for _, sentence in self._node.remarks]
            self.push_screen(Page('What this desk told', lambda: said))

    def _later(self, work: Callable[[], None]) -> None:
        """Do what waits for the cell beside the keys."""
        threading.Thread(target=work, daemon=True).start()


def inference_silent(view: DeskView) -> bool:
    """Whether nobody takes an answer now."""
    status = dict(view.nodes).get('inference_node')
    return status is None or status.state in ('silent', 'absent')

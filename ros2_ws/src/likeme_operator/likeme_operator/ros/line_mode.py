"""Line mode: the desk as lines of text, for pipes and screen readers."""

from __future__ import annotations

import sys
import time
from collections import deque

import typer

from likeme_inference.console_replies import TypedAnswer, read_answer
from likeme_inference.keyboard import DISCARDED, Keyboard
from likeme_msgs.msg import HelpRequest
from likeme_operator.operator_node import (
    POLL_PERIOD,
    REPEAT_PERIOD,
    SILENCE,
    OperatorNode,
    ServiceAbsentError,
)
from likeme_operator.ros.cell_events import CellEvent
from likeme_operator.ros.command_output import connected
from likeme_operator.ros.event_stream import EventStream
from likeme_operator.ros.request_text import request_text
from likeme_operator.ros.views_of_messages import question_key

#: s between two looks at the pending requests that no event caused.
LOOK_PERIOD = 1.0
#: Who asks.
ASKS = 'inference_node'
#: Events that a line tells of; the others belong to a question.
TOLD = ('outcome', 'hold', 'resume')
HOLD = 'hold'


class LineNode(OperatorNode):
    """A desk that keeps the events until they are told.

    Attributes:
        events: those that are not told yet.
    """

    def __init__(self, by: str) -> None:
        """by: name of the operator."""
        super().__init__(by)
        self.events: deque[CellEvent] = deque()
        EventStream(self, lambda: self.names, lambda event, _: self.events.append(event))


class LineMode:
    """Shows one question after the other, takes a line as the answer, and tells what follows."""

    def __init__(self, node: LineNode, keyboard: Keyboard) -> None:
        self._node, self._keyboard = node, keyboard
        self._looked = 0.0
        self._silent = False
        self._typed_before = False
        self._ended = False
        self._prompted = False

    def run(self) -> None:
        """Serve until the input ends under a question.

        Raises:
            EOFError: it ended.
        """
        while True:
            request = self._next_request()
            self._show(request)
            typed = self._read_answer(request)
            if typed is not None:
                self._answer(request, typed)

    def _answer(self, request: HelpRequest, typed: TypedAnswer) -> None:
        try:
            response = self._node.answer(
                question_key(request, self._node.names), *typed, self._is_silent
            )
        except ServiceAbsentError as error:
            # Whether it arrived is told by the next look: the question is shown again or not.
            self._say(str(error))
            return
        self._say(response.message)
        if response.success:
            self._follow(request)

    def _next_request(self) -> HelpRequest:
        """Wait for a pending request, and tell what happens meanwhile; the oldest."""
        while True:
            changed = self._tell()
            if changed or time.monotonic() - self._looked > LOOK_PERIOD:
                self._looked = time.monotonic()
                if pending := self._pending():
                    return pending[0]
            if self._ended:
                time.sleep(POLL_PERIOD)
            elif self._keyboard.ready(POLL_PERIOD):
                self._read_between()

    def _read_between(self) -> None:
        """Read a line that was typed while nothing was asked: only `hold` counts."""
        try:
            typed = self._keyboard.line()
        except EOFError:
            self._ended = True
            return
        if typed.strip().lower() == HOLD:
            self._hold()
        else:
            self._typed_before = True

    def _show(self, request: HelpRequest) -> None:
        self._say(request_text(request, self._node.wait_for_world()))
        if self._keyboard.discard() or self._typed_before:
            self._say(DISCARDED)
        self._typed_before = False

    def _read_answer(self, request: HelpRequest) -> TypedAnswer | None:
        """The answer that is typed; None: somebody else's came first, or it is asked no more.

        Raises:
            EOFError: the input ended.
        """
        self._prompt()
        while True:
            told = self._tell()
            if told or time.monotonic() - self._looked > LOOK_PERIOD:
                self._looked = time.monotonic()
                pending = self._pending()
                if pending is not None and not self._is_among(pending, request):
                    return None
                if not self._prompted:
                    self._prompt()
            if not self._keyboard.ready(POLL_PERIOD):
                continue
            try:
                typed = self._keyboard.line()
                # Enter has ended the prompt's line.
                self._prompted = False
            except EOFError:
                self._say(f'No more input: request {request.id} stays unanswered.')
                raise
            if typed.strip().lower() == HOLD:
                self._hold()
            else:
                try:
                    return read_answer(typed)
                except ValueError as error:
                    self._say(str(error))
            self._prompt()

    def _prompt(self) -> None:
        # It says that what is typed from here on is read.
        typer.echo('> ', nl=False)
        self._prompted = True

    def _say(self, sentence: str, alarm: bool = False) -> None:
        """Print a sentence on a line of its own, with a bell where there is one."""
        bell = '\a' if alarm and sys.stdout.isatty() else ''
        typer.echo(('\n' if self._prompted else '') + bell + sentence)
        self._prompted = False

    def _pending(self) -> list[HelpRequest] | None:
        """The pending requests; None if the inference node does not tell them, or is silent.

        Its silence is told while it is waited for.
        """
        answers: list[list[HelpRequest]] = []
        self._node.ask_for_pending(answers.append)
        asked = time.monotonic()
        while not self._silent and time.monotonic() - asked < REPEAT_PERIOD:
            if answers:
                return answers[0]
            time.sleep(POLL_PERIOD)
            self._tell_silence()
        return None

    def _is_among(self, pending: list[HelpRequest], request: HelpRequest) -> bool:
        key = question_key(request, self._node.names)
        return any(question_key(each, self._node.names) == key for each in pending)

    def _follow(self, request: HelpRequest) -> None:
        """Tell until an answered request has ended, or its node fell silent."""
        while not self._silent:
            if self._tell(request.id):
                return
            time.sleep(POLL_PERIOD)

    def _tell(self, until: int | None = None) -> bool:
        """Tell what was heard; whether anything was, or the outcome of a decision: `until`."""
        told = self._tell_silence()
        while self._node.events:
            event = self._node.events.popleft()
            if event.kind == 'outcome':
                self._say(event.data['sentence'])
                told = told or until in (None, event.data['decision'])
            elif event.kind in TOLD:
                self._say(f'{"HELD" if event.kind == "hold" else "Motion is allowed again"}, '
                    f'{event.sentence}.')  # fmt: skip
                told = told or until is None
            elif event.kind == 'answer' and until is None:
                self._say(event.sentence)
                told = True
            elif event.kind == 'decision':
                told = told or until is None
        return told

    def _tell_silence(self) -> bool:
        silent = self._is_silent()
        if silent == self._silent:
            return False
        self._silent = silent
        if silent:
            self._say(
                'ALARM: the inference node is not heard: nothing is asked and no answer is '
                'taken until it is.',
                alarm=True,
            )
        else:
            self._say('The inference node is heard again.')
        return True

    def _is_silent(self) -> bool:
        return self._node.silence_of(ASKS) > SILENCE

    def _hold(self) -> None:
        delay = self._node.stop(self._node.by)
        if delay is None:
            self._say('STOP was sent, and not confirmed. Use the hardware stop.', alarm=True)
        else:
            self._say(
                f'HELD, confirmed after {delay * 1e3:.0f} ms. `operator.sh resume` allows motion '
                'again.'
            )


def line_mode(by: str, network: bool, domain: int) -> None:
    """Wait for requests and read answers, a line each; Ctrl-C ends.

    Exit code 1: the input ended under a question, 3: nobody serves ask_human.
    """
    with connected(by, network, domain, create=LineNode) as node:
        node.pending()
        node.wait_for_world()
        typer.echo(
            'Waiting for requests of the robot. `hold` and Enter stops every motion. Ctrl-C ends.'
        )
        try:
            LineMode(node, Keyboard(sys.stdin.fileno())).run()
        except EOFError:
            raise typer.Exit(1) from None

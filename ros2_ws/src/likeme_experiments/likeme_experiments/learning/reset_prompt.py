"""Asks a person at the terminal to set objects up: one question, then a word as the answer."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from enum import StrEnum
from typing import Protocol

from likeme_core.world import World
from likeme_inference.console_replies import read_choice
from likeme_inference.experience.reset_planning import Reset
from likeme_inference.keyboard import DISCARDED, Keyboard

#: Waits until a condition holds; may raise.
Wait = Callable[[Callable[[], bool]], None]
MENU = (
    '  1  done  it is so: the robot looks, and may move from now on\n  2  skip  leave it for later'
)


class ResetAnswer(StrEnum):
    """What a person answers."""

    DONE = 'done'
    SKIP = 'skip'


class ResetDesk(Protocol):
    """Where people are asked for resets."""

    def ask(self, resets: Sequence[Reset], reasons: Sequence[str] = ()) -> ResetAnswer:
        """Ask for resets, all at once. reasons: why they are needed, where it is not plain."""


class ResetPrompt:
    """Shows a request for resets and reads its answer; what was typed before is none."""

    def __init__(
        self, world: World, keyboard: Keyboard, say: Callable[[str], None], wait: Wait
    ) -> None:
        """say: prints a line. wait: for the keyboard, while the node goes on."""
        self._world, self._keyboard, self._say, self._wait = world, keyboard, say, wait

    def ask(self, resets: Sequence[Reset], reasons: Sequence[str] = ()) -> ResetAnswer:
        """See ResetDesk.

        Raises:
            EOFError: the input ended.
        """
        for reason in reasons:
            self._say(reason)
        self._say(request_sentence(self._world, resets))
        if self._keyboard.discard():
            self._say(DISCARDED)
        # It says that what is typed from here on is read.
        self._say(MENU)
        while True:
            self._wait(lambda: self._keyboard.ready(0.0))
            try:
                return ResetAnswer(read_choice(self._keyboard.line(), tuple(ResetAnswer)))
            except ValueError as error:
                self._say(str(error))


def request_sentence(world: World, resets: Sequence[Reset]) -> str:
    """What a person is asked to do."""
    elsewhere = world.regions.elsewhere
    parts = [
        f'take the {name} off the table ({state.name})'
        if state == elsewhere
        else f'put the {name} {state.name}'
        for name, state in resets
    ]
    room = '' if all(state == elsewhere for _, state in resets) else ', with room around it'
    return f'Please {", ".join(parts)}{room}. The arm does not move until you answer.'

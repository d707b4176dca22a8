"""Requests for resets at a terminal, and their answers."""

from __future__ import annotations

import os
from collections.abc import Callable

import pytest

from likeme_core.paper_world import LEFT, OFFTABLE, RIGHT, WORLD
from likeme_experiments.learning.reset_prompt import (
    ResetAnswer,
    ResetPrompt,
    request_sentence,
)
from likeme_inference.console_replies import read_choice
from likeme_inference.experience.reset_planning import Reset
from likeme_inference.keyboard import DISCARDED, Keyboard

RESETS = Reset('pear', RIGHT), Reset('lemon', OFFTABLE)


def test_all_resets_are_in_one_sentence() -> None:
    assert request_sentence(WORLD, RESETS) == (
        'Please put the pear RIGHT, take the lemon off the table (OFFTABLE), with room around it. '
        'The arm does not move until you answer.'
    )
    assert 'room' not in request_sentence(WORLD, RESETS[1:])


@pytest.mark.parametrize(
    ('typed', 'answer'),
    [('done', ResetAnswer.DONE), (' D', ResetAnswer.DONE), ('2', ResetAnswer.SKIP)],
)
def test_words_numbers_and_abbreviations(typed: str, answer: ResetAnswer) -> None:
    assert ResetAnswer(read_choice(typed, tuple(ResetAnswer))) is answer


@pytest.mark.parametrize('typed', ['', '3', 'try'])
def test_other_words_are_refused(typed: str) -> None:
    with pytest.raises(ValueError, match='Expected one of done, skip, got'):
        read_choice(typed, tuple(ResetAnswer))


def test_what_was_typed_before_is_no_answer() -> None:
    read, write = os.pipe()
    said: list[str] = []

    def person(condition: Callable[[], bool]) -> None:
        """Types when asked for the first time."""
        if not condition():
            os.write(write, b'maybe\nskip\n')
        assert condition()

    os.write(write, b'done\n')
    prompt = ResetPrompt(WORLD, Keyboard(read), said.append, person)
    try:
        assert prompt.ask([Reset('pear', LEFT)]) is ResetAnswer.SKIP
        assert DISCARDED in said
        assert said[-1] == "Expected one of done, skip, got 'maybe'."
        os.close(write)
        with pytest.raises(EOFError):
            prompt.ask([Reset('pear', LEFT)])
    finally:
        os.close(read)

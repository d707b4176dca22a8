from __future__ import annotations

import os
from collections.abc import Iterator

import pytest

from likeme_bringup.demo import _ask_at_keyboard
from likeme_bringup.demo_node import DemoStoppedError
from likeme_inference.keyboard import DISCARDED, Keyboard
from likeme_inference.tabletop.values import Reply


@pytest.fixture
def pipe() -> Iterator[tuple[int, int]]:
    ends = os.pipe()
    yield ends
    for end in ends:
        try:
            os.close(end)
        except OSError:
            # The test closed it.
            continue


def test_what_was_typed_before_the_question_is_no_answer(
    pipe: tuple[int, int], capsys: pytest.CaptureFixture[str]
) -> None:
    source, typed = pipe
    os.write(typed, b'try\n')
    lines = iter([b'perhaps\n', b'done\n'])
    answer, _ = _ask_at_keyboard(Keyboard(source), lambda: os.write(typed, next(lines)))
    assert answer == (Reply.DONE_BY_HAND, '')
    assert DISCARDED in capsys.readouterr().out


def test_the_end_of_the_input_ends_the_demo(pipe: tuple[int, int]) -> None:
    source, typed = pipe
    os.close(typed)
    with pytest.raises(DemoStoppedError, match='got end of file'):
        _ask_at_keyboard(Keyboard(source), lambda: None)
    with pytest.raises(DemoStoppedError, match='got end of file'):
        _ask_at_keyboard(None, lambda: None)

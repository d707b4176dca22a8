"""Progress is for a terminal's stderr; a pipe gets nothing of it."""

from __future__ import annotations

import threading

import pytest

from likeme_core.progress_bar import StatusLine, counted


def work() -> list[int]:
    line = StatusLine('Writing', 10.0)
    with line.shown():
        line.say('3 MB')
    return list(counted(iter((5, 6, 7)), 'things', 3))


def test_a_pipe_gets_the_items_and_no_bar(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for variable in ('FORCE_COLOR', 'TTY_COMPATIBLE'):
        monkeypatch.delenv(variable, raising=False)
    assert work() == [5, 6, 7]
    said = capsys.readouterr()
    assert (said.out, said.err.strip()) == ('', '')


def test_a_terminal_gets_both_with_the_time_left(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    # Makes rich take the captured stream for a terminal.
    monkeypatch.setenv('FORCE_COLOR', '1')
    assert work() == [5, 6, 7]
    said = capsys.readouterr()
    assert said.out == ''
    assert 'Writing: 3 MB' in said.err
    assert 'things' in said.err
    assert '3/3' in said.err
    assert 'left' in said.err


@pytest.mark.parametrize(('timed', 'more'), [(True, 0), (False, 1)])
def test_no_thread_draws_while_an_item_is_timed(
    timed: bool, more: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv('FORCE_COLOR', '1')
    # Threads of other tests may end meanwhile.
    before = set(threading.enumerate())
    begun = [
        len(set(threading.enumerate()) - before) for _ in counted(range(3), 'calls', 3, timed)
    ]
    assert begun == [more] * 3
    assert '3/3' in capsys.readouterr().err

"""Ctrl-C is noted, comes out where it is asked for, and is never lost."""

from __future__ import annotations

import signal

import pytest

from likeme_core.interrupt import noted_interrupt


def test_it_comes_out_once_and_where_it_is_asked_for() -> None:
    with noted_interrupt() as check:
        check()
        signal.raise_signal(signal.SIGINT)
        with pytest.raises(KeyboardInterrupt):
            check()
        check()
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_nobody_asked() -> None:
    with pytest.raises(KeyboardInterrupt), noted_interrupt():
        signal.raise_signal(signal.SIGINT)


def test_the_second_is_pythons_own() -> None:
    with noted_interrupt() as check:
        signal.raise_signal(signal.SIGINT)
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        with pytest.raises(KeyboardInterrupt):
            check()


def interrupted_and_wrong() -> None:
    with noted_interrupt():
        signal.raise_signal(signal.SIGINT)
        raise ValueError('inside')


def test_what_went_wrong_inside_is_told() -> None:
    with pytest.raises(ValueError, match='inside'):
        interrupted_and_wrong()

"""A signal is deferred to the next check and never lost."""

from __future__ import annotations

import signal

import pytest

from likeme_core.interrupt import deferred_interrupt


def test_a_check_raises_it_once() -> None:
    with deferred_interrupt() as check:
        check()
        signal.raise_signal(signal.SIGINT)
        with pytest.raises(KeyboardInterrupt):
            check()
        check()
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_it_is_raised_at_the_end_without_a_check() -> None:
    with pytest.raises(KeyboardInterrupt), deferred_interrupt():
        signal.raise_signal(signal.SIGINT)


def test_a_second_signal_is_raised_at_once() -> None:
    with deferred_interrupt() as check:
        signal.raise_signal(signal.SIGINT)
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        with pytest.raises(KeyboardInterrupt):
            check()


def test_sigterm_is_deferred_too_if_it_is_named() -> None:
    before = signal.getsignal(signal.SIGTERM)
    with deferred_interrupt(signal.SIGINT, signal.SIGTERM) as check:
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.raise_signal(number)
            with pytest.raises(KeyboardInterrupt):
                check()
    assert signal.getsignal(signal.SIGTERM) is before


def interrupt_and_fail() -> None:
    with deferred_interrupt():
        signal.raise_signal(signal.SIGINT)
        raise ValueError('inside')


def test_an_error_inside_takes_precedence() -> None:
    with pytest.raises(ValueError, match='inside'):
        interrupt_and_fail()

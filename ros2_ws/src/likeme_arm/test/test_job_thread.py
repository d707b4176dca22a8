"""The thread of a driver."""

from __future__ import annotations

import threading
from collections.abc import Iterator

import pytest

from likeme_arm.job_thread import JobThread


@pytest.fixture
def idled() -> threading.Event:
    return threading.Event()


@pytest.fixture
def thread(idled: threading.Event) -> Iterator[JobThread]:
    def idle() -> None:
        idled.set()
        threading.Event().wait(0.001)

    thread = JobThread(idle, lambda error: None)
    thread.start()
    yield thread
    thread.stop()


def test_idles_until_there_is_a_job(thread: JobThread, idled: threading.Event) -> None:
    assert idled.wait(5.0)
    job = thread.submit('arm', lambda: threading.current_thread().name)
    assert job is not None
    assert job.result(5.0) == 'driver'


def test_takes_one_job_of_an_owner_at_a_time(thread: JobThread) -> None:
    go_on = threading.Event()
    first = thread.submit('arm', lambda: go_on.wait(5.0))
    assert first is not None
    assert thread.submit('arm', lambda: True) is None
    go_on.set()
    assert first.result(5.0)
    again = thread.submit('arm', lambda: True)
    assert again is not None
    assert again.result(5.0)


def test_a_job_of_another_owner_waits_for_its_turn(thread: JobThread) -> None:
    go_on, order = threading.Event(), []
    first = thread.submit('human', lambda: go_on.wait(5.0) and order.append('human'))
    second = thread.submit('arm', lambda: order.append('arm'))
    assert first is not None
    assert second is not None
    assert not second.done()
    go_on.set()
    second.result(5.0)
    assert order == ['human', 'arm']


def test_the_error_of_a_job_is_set_on_its_future(thread: JobThread) -> None:
    failing = thread.submit('arm', lambda: 1 / 0)
    assert failing is not None
    assert isinstance(failing.exception(5.0), ZeroDivisionError)
    assert not thread.busy


def test_an_error_of_idling_is_reported() -> None:
    errors: list[Exception] = []
    twice = threading.Event()

    def tell(error: Exception) -> None:
        errors.append(error)
        if len(errors) == 2:
            twice.set()

    thread = JobThread(lambda: [][0], tell)
    thread.start()
    assert twice.wait(5.0)
    thread.stop()


def test_a_stopped_thread_accepts_no_jobs(thread: JobThread) -> None:
    thread.stop()
    assert thread.submit('arm', lambda: True) is None

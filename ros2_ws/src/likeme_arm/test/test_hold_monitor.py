from __future__ import annotations

import time
from pathlib import Path

import pytest

from graph import LATCHED, Graph
from likeme_arm.hold_monitor import Block, HoldMonitor
from likeme_arm.ros.hold_topics import HoldTopics
from likeme_msgs.msg import HoldState


class Monitored:
    """A monitor with a clock of its own."""

    def __init__(self) -> None:
        self.now = 100.0
        self.monitor = HoldMonitor(0.3, lambda: self.now)

    @property
    def block(self) -> Block | None:
        return self.monitor.block


@pytest.fixture
def it() -> Monitored:
    return Monitored()


def test_nothing_moves_before_a_keeper_is_heard(it: Monitored) -> None:
    assert it.block is Block.UNHEARD
    it.monitor.hear(held=False, change=0)
    assert it.block is None


def test_a_silent_keeper_blocks_and_is_heard_again(it: Monitored) -> None:
    it.monitor.hear(held=False, change=5)
    it.now += 0.29
    assert it.block is None
    it.now += 0.02
    assert it.block is Block.UNHEARD
    it.monitor.hear(held=False, change=5)
    assert it.block is None


def test_a_hold_stays_through_a_silence_until_it_is_resumed(it: Monitored) -> None:
    it.monitor.hear(held=True, change=7)
    it.now += 9.0
    assert it.block is Block.HELD
    it.monitor.hear(held=False, change=8)
    assert it.block is None


def test_a_keeper_that_forgot_the_hold_gives_no_consent(it: Monitored) -> None:
    it.monitor.hear(held=True, change=7)
    it.monitor.hear(held=False, change=0)
    assert it.block is Block.HELD
    it.monitor.hear(held=False, change=8)
    it.now += 1.0
    it.monitor.hear(held=False, change=7)
    assert it.block is Block.UNHEARD


def test_a_stop_blocks_at_once_until_the_keeper_has_held_and_resumed(it: Monitored) -> None:
    it.monitor.hear(held=False, change=7)
    it.monitor.stop()
    assert it.block is Block.STOPPED
    assert it.monitor.unconfirmed
    # Sent before the keeper heard of the stop; then a resume that crossed it on the way.
    it.monitor.hear(held=False, change=7)
    it.monitor.hear(held=False, change=8)
    assert it.block is Block.STOPPED
    it.monitor.hear(held=True, change=9)
    assert it.block is Block.HELD
    assert not it.monitor.unconfirmed
    it.monitor.hear(held=False, change=10)
    assert it.block is None


def test_a_stop_of_a_held_cell_outlasts_the_resume_it_crossed(it: Monitored) -> None:
    it.monitor.hear(held=True, change=7)
    it.monitor.stop()
    it.monitor.hear(held=True, change=7)
    it.monitor.hear(held=False, change=8)
    assert it.block is Block.STOPPED


def test_a_state_that_waited_is_no_sign_that_the_keeper_lives(it: Monitored) -> None:
    it.monitor.hear(held=False, change=5, age=0.4)
    assert it.block is Block.UNHEARD
    it.monitor.hear(held=False, change=5, age=0.1)
    assert it.block is None
    it.now += 0.15
    it.monitor.hear(held=False, change=5, age=0.28)
    assert it.block is None
    it.now += 0.1
    assert it.block is Block.UNHEARD
    it.monitor.hear(held=True, change=6, age=9.0)
    assert it.block is Block.HELD


@pytest.mark.graph
def test_a_driver_counts_the_silence_from_the_arrival_of_a_state(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        monitor = HoldMonitor(0.3)
        HoldTopics(graph.node, monitor)
        keeper = graph.background_node('keeper').create_publisher(
            HoldState, 'cell/hold_state', LATCHED
        )
        keeper.publish(HoldState())
        graph.until(lambda: monitor.block is None, 10, 'a keeper')
        graph.until(lambda: monitor.block is Block.UNHEARD, 1, 'a silence')
        keeper.publish(HoldState(change=1))
        # The driver's executor is busy meanwhile.
        time.sleep(0.5)
        graph.until(lambda: monitor.change == 1, 10, 'the state that waited')
        assert monitor.block is Block.UNHEARD

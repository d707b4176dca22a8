"""What the perception node says of itself in its heartbeat."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from likeme_core.heartbeats import NodeState, described
from likeme_perception.health import FrameHealth


def reader(intrinsics: object = None, background_learned: bool = False) -> Any:
    return SimpleNamespace(
        intrinsics=intrinsics, background_learned=background_learned, reason='', perception=None
    )


def test_it_is_starting_until_the_background_is_learned() -> None:
    health = FrameHealth(0.0)
    assert health.state(reader(), 0.5) == (NodeState.STARTING, 'no camera_info has come yet')
    health.drop('camera_info is unusable')
    assert health.state(reader(), 0.5) == (NodeState.STARTING, 'camera_info is unusable')
    health.read(1.0)
    learning = reader(intrinsics=1)
    assert health.state(learning, 1.1) == (NodeState.STARTING, 'the background is learned')
    assert health.state(learning, 4.0) == (NodeState.STARTING, 'no frame has come for 3 s')


def test_it_is_degraded_while_no_frame_can_be_read() -> None:
    health, watching = FrameHealth(0.0), reader(1, background_learned=True)
    health.read(10.0)
    assert health.state(watching, 10.9) == (NodeState.READY, '')
    # One lost frame between two good ones is no matter.
    health.drop('Expected rgb8, got mono8.')
    assert health.state(watching, 10.9) == (NodeState.READY, '')
    assert health.state(watching, 11.1) == (NodeState.DEGRADED, 'Expected rgb8, got mono8.')
    health.read(11.2)
    assert health.state(watching, 13.2) == (NodeState.DEGRADED, 'no frame has come for 2 s')


def test_it_is_degraded_while_frames_tell_nothing() -> None:
    health, watching = FrameHealth(0.0), reader(1, background_learned=True)
    watching.reason = 'camera moved'
    health.read(1.0)
    said = NodeState.DEGRADED, 'all states are unknown: camera moved'
    assert health.state(watching, 1.1) == said


def test_it_says_that_the_background_is_not_learned_because_things_move() -> None:
    learning = reader(1)
    learning.perception = SimpleNamespace(restarts=3)
    said = 'the background is learned, something moved: begun anew 3 times'
    assert FrameHealth(0.0).state(learning, 0.5) == (NodeState.STARTING, said)


def test_a_state_in_one_phrase() -> None:
    assert described(NodeState.READY, '') == 'ready'
    assert described(NodeState.STARTING, 'it warms up') == 'starting: it warms up'

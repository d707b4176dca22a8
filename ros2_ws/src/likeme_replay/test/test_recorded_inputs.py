"""Frames and session inputs of a bag, and their order."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import pytest

import camera_messages
from likeme_bags.camera_topics import COLOUR, DEPTH, INFO
from likeme_bags.errors import BagError
from likeme_bags.values import Record
from likeme_core.paper_world import WORLD
from likeme_inference.session_inputs import InputKind, SessionInput
from likeme_replay.input_scheduler import FrameAck, InputScheduler
from likeme_replay.message_definitions import definitions
from likeme_replay.recorded_inputs import (
    CAMERA_TOPICS,
    FRAME_DONE,
    HEARD,
    REPLAY_TOPICS,
    RecordedFrame,
    RecordedInputs,
    RecordSource,
)

SECOND = 1_000_000_000


def record(topic: str, stamp: int) -> Record:
    """A tiny image or camera_info."""
    rgb, depth = np.zeros((8, 8, 3), np.uint8), np.ones((8, 8), np.uint16)
    made = camera_messages.frame_records(stamp, rgb, depth, WORLD.camera)
    return next(r for r in made if r.topic == topic)


def done(stamp: int, kind: int = 1) -> Record:
    message = definitions().make(
        'likeme_msgs/msg/FrameDone', header=camera_messages.header(stamp), kind=kind,
        table_state=True, demonstrations=0, reason='',
    )  # fmt: skip
    return Record(FRAME_DONE, 'likeme_msgs/msg/FrameDone', stamp, definitions().write(message))


def heard(kind: InputKind, stamp: int) -> Record:
    data = camera_messages.heard(SessionInput(kind, stamp), 1)
    return Record(HEARD, 'likeme_msgs/msg/Heard', stamp, data)


def inputs(records: Iterable[Record], *more: str) -> RecordedInputs:
    topics = dict(CAMERA_TOPICS) | {name: REPLAY_TOPICS[name] for name in more}
    return RecordedInputs(RecordSource('the bag', topics, iter(list(records))))


def images(*stamps: int) -> list[Record]:
    return [record(topic, stamp) for stamp in stamps for topic in (INFO, COLOUR, DEPTH)]


def stamps(steps: Iterable[object]) -> list[int]:
    return [step.stamp for step in steps if isinstance(step, RecordedFrame)]


def test_colour_and_depth_of_one_stamp_are_a_frame() -> None:
    played = inputs([*images(1 * SECOND), record(COLOUR, 2 * SECOND), *images(3 * SECOND)])
    assert stamps(played.steps()) == [1 * SECOND, 3 * SECOND]
    assert played.unpaired == 1


def test_frames_wait_for_the_first_camera_info() -> None:
    early = [record(COLOUR, SECOND), record(DEPTH, SECOND)]
    assert stamps(inputs([*early, *images(2 * SECOND)]).steps()) == [SECOND, 2 * SECOND]


def test_only_frames_that_the_live_run_read_are_shown() -> None:
    played = inputs([*images(1, 2, 3, 4), done(1), done(2, kind=2), done(3)], FRAME_DONE)
    assert stamps(played.steps()) == [1, 3]
    assert played.unread == 2


def test_a_frame_may_be_read_before_the_recorder_has_its_depth() -> None:
    late = [record(INFO, 1), record(COLOUR, 1), done(1), record(DEPTH, 1)]
    assert stamps(inputs(late, FRAME_DONE).steps()) == [1]


def test_inputs_of_the_live_session_are_read() -> None:
    played = inputs(
        [*images(5), heard(InputKind.TABLE_STATE, 5), heard(InputKind.SILENCE, 5)], HEARD
    )
    frame, first, second = list(played.steps())
    assert isinstance(frame, RecordedFrame)
    assert isinstance(first, SessionInput)
    assert isinstance(second, SessionInput)
    assert played.live
    assert [first.kind, second.kind] == [InputKind.TABLE_STATE, InputKind.SILENCE]


def test_a_missing_topic_and_a_wrong_type_are_refused_by_name() -> None:
    with pytest.raises(BagError, match='expected the topic camera/rgb/image_rect_color'):
        RecordedInputs(RecordSource('b', {}, iter(())))
    with pytest.raises(BagError, match=r'camera_info as sensor_msgs/msg/CameraInfo, got x/msg/Y'):
        RecordedInputs(RecordSource('b', dict(CAMERA_TOPICS) | {INFO: 'x/msg/Y'}, iter(())))


def test_bytes_that_are_no_such_message_are_left_out_and_counted() -> None:
    torn = [Record(topic, kind, 1, b'\0\1\0\0\7') for topic, kind in CAMERA_TOPICS.items()]
    played = inputs([*images(1), *torn, *images(2)])
    assert stamps(played.steps()) == [1, 2]
    assert played.unreadable == 3


def test_without_recorded_inputs_each_table_state_is_one_and_then_its_demonstrations() -> None:
    scheduler = InputScheduler(recorded=False)
    scheduler.add_frame(1, FrameAck(False))
    scheduler.add_frame(2, FrameAck(True, (None, None)))  # type: ignore[arg-type]
    assert [(c.kind, c.stamp) for c in scheduler.ready()] == [
        (InputKind.TABLE_STATE, 2), (InputKind.DEMONSTRATION, 2), (InputKind.DEMONSTRATION, 2)
    ]  # fmt: skip


def test_a_recorded_input_waits_for_its_frame_and_keeps_its_place() -> None:
    scheduler = InputScheduler(recorded=True)
    for kind, stamp in (
        (InputKind.TABLE_STATE, 2),
        (InputKind.MOTION, 2),
        (InputKind.TABLE_STATE, 3),
    ):
        scheduler.add_input(SessionInput(kind, stamp))
    assert list(scheduler.ready()) == []
    scheduler.add_frame(2, FrameAck(True))
    assert [c.kind for c in scheduler.ready()] == [InputKind.TABLE_STATE, InputKind.MOTION]
    scheduler.add_frame(3, FrameAck(True))
    assert [c.stamp for c in scheduler.ready()] == [3]
    scheduler.finish()
    assert (scheduler.missed, scheduler.unrecorded) == (0, 0)


def test_inputs_that_do_not_arise_again_are_counted() -> None:
    scheduler = InputScheduler(recorded=True)
    scheduler.add_input(SessionInput(InputKind.DEMONSTRATION, 1))
    scheduler.add_frame(1, FrameAck(True))
    scheduler.add_frame(2, FrameAck(True, (None,)))  # type: ignore[arg-type]
    assert list(scheduler.ready()) == []
    scheduler.finish()
    assert (scheduler.missed, scheduler.unrecorded) == (1, 1)

"""Which frames and cues a bag gives, and in which order."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import pytest

import camera_messages
from likeme_arm_sim.scene import CameraMount
from likeme_bags.adapting import COLOUR, DEPTH, INFO
from likeme_bags.errors import BagError
from likeme_bags.values import Record
from likeme_inference.input_sequencer import Cue, Input
from likeme_replay.input_scheduler import Done, Prompter
from likeme_replay.message_definitions import definitions
from likeme_replay.recorded_inputs import FRAME_DONE, HEARD, NEEDED, Frame, Script, Source

SECOND = 1_000_000_000


def record(topic: str, stamp: int) -> Record:
    """A tiny image or camera_info."""
    rgb, depth = np.zeros((8, 8, 3), np.uint8), np.ones((8, 8), np.uint16)
    made = camera_messages.frame_records(stamp, rgb, depth, CameraMount())
    return next(r for r in made if r.topic == topic)


def done(stamp: int, kind: int = 1) -> Record:
    message = definitions().make(
        'likeme_msgs/msg/FrameDone', header=camera_messages.header(stamp), kind=kind,
        table_state=True, demonstrations=0, reason='',
    )  # fmt: skip
    return Record(FRAME_DONE, 'likeme_msgs/msg/FrameDone', stamp, definitions().write(message))


def heard(kind: Input, stamp: int) -> Record:
    data = camera_messages.heard(Cue(kind, stamp, None), 1)
    return Record(HEARD, 'likeme_msgs/msg/Heard', stamp, data)


def script(records: Iterable[Record], *more: str) -> Script:
    topics = dict(NEEDED) | dict.fromkeys(more, '')
    return Script(Source('the bag', topics, iter(list(records))))


def images(*stamps: int) -> list[Record]:
    return [record(topic, stamp) for stamp in stamps for topic in (INFO, COLOUR, DEPTH)]


def stamps(steps: Iterable[object]) -> list[int]:
    return [step.stamp for step in steps if isinstance(step, Frame)]


def test_colour_and_depth_of_one_stamp_are_a_frame() -> None:
    played = script([*images(1 * SECOND), record(COLOUR, 2 * SECOND), *images(3 * SECOND)])
    assert stamps(played.steps()) == [1 * SECOND, 3 * SECOND]
    assert played.unpaired == 1


def test_frames_wait_for_the_first_camera_info() -> None:
    early = [record(COLOUR, SECOND), record(DEPTH, SECOND)]
    assert stamps(script([*early, *images(2 * SECOND)]).steps()) == [SECOND, 2 * SECOND]


def test_only_frames_that_the_live_run_read_are_shown() -> None:
    played = script([*images(1, 2, 3, 4), done(1), done(2, kind=2), done(3)], FRAME_DONE)
    assert stamps(played.steps()) == [1, 3]
    assert played.unread == 2


def test_a_frame_may_be_read_before_the_recorder_has_its_depth() -> None:
    late = [record(INFO, 1), record(COLOUR, 1), done(1), record(DEPTH, 1)]
    assert stamps(script(late, FRAME_DONE).steps()) == [1]


def test_what_the_session_heard_is_a_cue() -> None:
    played = script([*images(5), heard(Input.TABLE_STATE, 5), heard(Input.SILENCE, 5)], HEARD)
    frame, first, second = list(played.steps())
    assert isinstance(frame, Frame)
    assert isinstance(first, Cue)
    assert isinstance(second, Cue)
    assert played.live
    assert [first.kind, second.kind] == [Input.TABLE_STATE, Input.SILENCE]


def test_a_missing_topic_and_a_wrong_type_are_refused_by_name() -> None:
    with pytest.raises(BagError, match='expected the topic camera/rgb/image_rect_color'):
        Script(Source('b', {}, iter(())))
    with pytest.raises(BagError, match=r'camera_info as sensor_msgs/msg/CameraInfo, got x/msg/Y'):
        Script(Source('b', dict(NEEDED) | {INFO: 'x/msg/Y'}, iter(())))


def test_bytes_that_are_no_such_message_are_left_out_and_counted() -> None:
    torn = [Record(topic, kind, 1, b'\0\1\0\0\7') for topic, kind in NEEDED.items()]
    played = script([*images(1), *torn, *images(2)])
    assert stamps(played.steps()) == [1, 2]
    assert played.unreadable == 3


def test_without_recorded_cues_each_table_state_is_one_and_then_its_demonstrations() -> None:
    prompter = Prompter(recorded=False)
    prompter.shown(1, Done(False))
    prompter.shown(2, Done(True, (None, None)))  # type: ignore[arg-type]
    assert [(c.kind, c.stamp) for c in prompter.due()] == [
        (Input.TABLE_STATE, 2), (Input.DEMONSTRATION, 2), (Input.DEMONSTRATION, 2)
    ]  # fmt: skip


def test_a_recorded_cue_waits_for_its_frame_and_keeps_its_place() -> None:
    prompter = Prompter(recorded=True)
    for kind, stamp in ((Input.TABLE_STATE, 2), (Input.MOTION, 2), (Input.TABLE_STATE, 3)):
        prompter.cue(Cue(kind, stamp, None))
    assert list(prompter.due()) == []
    prompter.shown(2, Done(True))
    assert [c.kind for c in prompter.due()] == [Input.TABLE_STATE, Input.MOTION]
    prompter.shown(3, Done(True))
    assert [c.stamp for c in prompter.due()] == [3]
    prompter.end()
    assert (prompter.missed, prompter.unheard) == (0, 0)


def test_what_does_not_come_about_again_is_counted() -> None:
    prompter = Prompter(recorded=True)
    prompter.cue(Cue(Input.DEMONSTRATION, 1, None))
    prompter.shown(1, Done(True))
    prompter.shown(2, Done(True, (None,)))  # type: ignore[arg-type]
    assert list(prompter.due()) == []
    prompter.end()
    assert (prompter.missed, prompter.unheard) == (1, 1)

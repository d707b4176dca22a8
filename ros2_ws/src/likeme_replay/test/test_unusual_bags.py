"""Bags of other robots: topics of the same names and other types, frames that cannot be read."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import camera_messages
from likeme_bags.camera_topics import CAMERA_INFO, COLOUR, DEPTH, INFO
from likeme_bags.images import IMAGE
from likeme_bags.values import Record, Topic
from likeme_bags.writing import BagWriter
from likeme_core.paper_world import WORLD
from likeme_replay.message_definitions import definitions
from likeme_replay.offline_replay import replay_offline
from likeme_replay.replay import app

STRING = 'std_msgs/msg/String'
BEGIN, PERIOD = 1_700_000_000_000_000_000, 100_000_000
CAMERA = WORLD.camera
Change = Callable[[int, Any], None]


def string(topic: str, stamp: int = BEGIN) -> Record:
    message = definitions().make(STRING, data='hello robot')
    return Record(topic, STRING, stamp, definitions().write(message))


def camera_records(count: int = 40, change: Change = lambda number, info: None) -> list[Record]:
    """Frames of an empty table 1 m below the camera; `change` alters their camera_info."""
    rgb = np.full((CAMERA.height, CAMERA.width, 3), 128, np.uint8)
    depth = np.full((CAMERA.height, CAMERA.width), 1000, np.uint16)
    records: list[Record] = []
    for number in range(count):
        stamp = BEGIN + number * PERIOD
        info, colour, depth_record = camera_messages.frame_records(stamp, rgb, depth, CAMERA)
        message = camera_messages.camera_info(stamp, CAMERA)
        change(number, message)
        records += [
            info._replace(data=definitions().write(message)), colour, depth_record
        ]  # fmt: skip
    return records


def write(path: Path, records: list[Record]) -> Path:
    """A bag of records; topics of one name and two types are two topics."""
    with BagWriter(path) as writer:
        for name, kind in dict.fromkeys((r.topic, r.type) for r in records):
            writer.add(Topic(name, kind))
        for record in records:
            writer.write(record)
    return path


def run(path: Path, *options: str) -> tuple[int, str]:
    """Exit code and messages of an offline replay."""
    done = CliRunner().invoke(app, (str(path), '--offline', *options))
    assert isinstance(done.exception, SystemExit | None), done.exception
    return done.exit_code, done.stderr


@pytest.mark.parametrize(
    'topic', ['/heard', 'frame_done', '/demonstration', 'goal_belief', '/decision', '/outcome']
)
def test_a_topic_of_another_type_is_not_read_for_its_name(topic: str, tmp_path: Path) -> None:
    plain = replay_offline(write(tmp_path / 'plain', camera_records(3)))
    records = [string(topic), *camera_records(3)]
    other = replay_offline(write(tmp_path / 'other', records))
    assert other.counts.frames == plain.counts.frames == 3
    assert other.counts.warnings == plain.counts.warnings
    assert other.agreements == ()


def test_a_camera_topic_of_another_type_is_refused_in_a_sentence(tmp_path: Path) -> None:
    records = [r for r in camera_records(3) if r.topic != INFO]
    records.append(string(INFO))
    code, said = run(write(tmp_path / 'bag', records))
    assert code == 1
    assert CAMERA_INFO in said
    assert STRING in said


def nothing(number: int, info: Any) -> None:
    """Zero intrinsics, as uncalibrated drivers publish."""
    info.k[:], info.p[:] = 0, 0


def autofocus(number: int, info: Any) -> None:
    """A little more in every frame."""
    for lens in (info.k, info.p):
        lens *= 1 + 1e-9 * number


def test_exit_code_1_when_no_frame_could_be_read(tmp_path: Path) -> None:
    code, said = run(write(tmp_path / 'zero', camera_records(3, nothing)))
    assert code == 1
    assert '3 of 3 frames were not read' in said
    assert 'focal lengths above 0, got 0' in said
    assert 'Expected frames that perception can read, got none of 3.' in said


def test_camera_info_that_changes_in_every_frame_is_reported(tmp_path: Path) -> None:
    code, said = run(write(tmp_path / 'autofocus', camera_records(40, autofocus)))
    assert code == 1
    assert 'camera_info changed 39 times' in said
    assert 'Expected table states, got none of 40 frames' in said


def test_exit_code_0_when_frames_were_read(tmp_path: Path) -> None:
    code, said = run(write(tmp_path / 'few', camera_records(3)))
    assert (code, '3 frames, 0 lines of log' in said) == (0, True), said


def test_two_types_in_one_camera_topic(tmp_path: Path) -> None:
    """The records of the right type are used."""
    for topic, kind in ((COLOUR, IMAGE), (DEPTH, IMAGE)):
        records = [string(topic), *camera_records(3)]
        assert kind in {r.type for r in records if r.topic == topic}
        assert (
            replay_offline(write(tmp_path / topic.replace('/', '_'), records)).counts.frames == 3
        )

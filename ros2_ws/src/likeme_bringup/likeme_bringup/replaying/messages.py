"""Cues and times as messages."""

from __future__ import annotations

from typing import Any

from builtin_interfaces.msg import Time
from std_msgs.msg import Header

from likeme_inference.rehearsal import Cue
from likeme_msgs.msg import Heard


def cue_message(cue: Cue) -> Heard:
    """What inference is told to take in next."""
    message = Heard(header=Header(stamp=time_of(cue.stamp)), kind=int(cue.kind))
    if cue.said is not None and not cue.kind.comes_by_topic:
        message.motion_outcome = int(cue.said.motion_outcome)
        message.finished = time_of(nanoseconds(cue.said.finished))
        message.answer, message.message = int(cue.said.answer), str(cue.said.message)
    return message


def time_of(nanoseconds: int) -> Time:
    """A time message of ns."""
    sec, nanosec = divmod(nanoseconds, 1_000_000_000)
    return Time(sec=sec, nanosec=nanosec)


def nanoseconds(stamp: Any) -> int:
    """The ns of a time message."""
    return int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)

"""Cues as messages."""

from __future__ import annotations

from std_msgs.msg import Header

from likeme_core.ros.time import stamp_ns, time_msg
from likeme_inference.input_sequencer import Cue
from likeme_msgs.msg import Heard


def cue_message(cue: Cue) -> Heard:
    """What inference is told to take in next."""
    message = Heard(header=Header(stamp=time_msg(cue.stamp)), kind=int(cue.kind))
    if cue.said is not None and not cue.kind.comes_by_topic:
        message.motion_outcome = int(cue.said.motion_outcome)
        message.finished = time_msg(stamp_ns(cue.said.finished))
        message.answer, message.message = int(cue.said.answer), str(cue.said.message)
    return message

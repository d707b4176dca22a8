"""Session inputs as messages of `hear_again`."""

from __future__ import annotations

from std_msgs.msg import Header

from likeme_core.ros.time import stamp_ns, time_msg
from likeme_inference.session_inputs import SessionInput
from likeme_msgs.msg import Heard


def hear_again_message(item: SessionInput) -> Heard:
    """The message that has inference apply an input next."""
    message = Heard(header=Header(stamp=time_msg(item.stamp)), kind=int(item.kind))
    if item.message is not None and not item.kind.has_topic:
        message.motion_outcome = int(item.message.motion_outcome)
        message.finished = time_msg(stamp_ns(item.message.finished))
        message.answer, message.message = int(item.message.answer), str(item.message.message)
        # Not in messages recorded before there could be several questions.
        message.object = str(getattr(item.message, 'object', ''))
    return message

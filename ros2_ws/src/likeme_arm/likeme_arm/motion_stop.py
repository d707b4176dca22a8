"""What ends a motion before it is complete, for every driver."""

from __future__ import annotations

from likeme_arm.hold_monitor import Block
from likeme_arm.motion import PrimitiveResult
from likeme_core.outcomes import MotionOutcome

#: s for which a motion waits at rest for a hold keeper that is not heard, before it ends.
KEEPER_PATIENCE = 2.0
_WHY = {
    Block.HELD: 'The motion was held before it was complete.',
    Block.STOPPED: 'The motion was stopped before it was complete.',
    Block.UNHEARD: 'The motion was stopped: the hold keeper was not heard any more.',
}


class MotionStoppedError(Exception):
    """The motion was stopped before this control step."""


def stopped(block: Block | None, cancelled: bool) -> PrimitiveResult:
    """How a motion ended that was stopped.

    Args:
        block: why nothing might move.
        cancelled: whether its request was cancelled; neither: its time was used up.
    """
    if block is not None:
        return PrimitiveResult(MotionOutcome.HELD, _WHY[block])
    if cancelled:
        message = 'The motion was cancelled before it was complete.'
        return PrimitiveResult(MotionOutcome.HELD, message)
    message = 'The motion was stopped: its time budget was used up before it was complete.'
    return PrimitiveResult(MotionOutcome.FAILED, message)

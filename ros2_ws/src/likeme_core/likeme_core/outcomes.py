"""Who acted and how a motion or a reset ended, with the numbers of likeme_msgs."""

from __future__ import annotations

from enum import IntEnum


class Actor(IntEnum):
    """Who acted; the numbers of likeme_msgs/Outcome."""

    ROBOT = 0
    HUMAN = 1
    NOBODY = 2


class MotionOutcome(IntEnum):
    """How a motion ended, as reported by the arm; the numbers of likeme_msgs/ExecuteAction."""

    COMPLETED = 0
    NOT_GRASPED = 1
    NO_IK_SOLUTION = 2
    HELD = 3
    OBJECT_NOT_SEEN = 4
    OBJECT_OFFTABLE = 5
    UNKNOWN_OBJECT = 6
    UNKNOWN_ACTION = 7
    BUSY = 8
    EXPIRED = 9
    FAILED = 10
    OTHER_WORLD = 11
    REPEATED = 12
    LOST = 13
    NOT_FREE = 14

    @property
    def moved(self) -> bool:
        """Whether the arm may have moved; the object's state must then be observed."""
        uncertain = (MotionOutcome.FAILED, MotionOutcome.LOST)
        return self <= MotionOutcome.HELD or self in uncertain


class ResetOutcome(IntEnum):
    """How a reset of the cell ended; the numbers of likeme_msgs/ResetCell."""

    COMPLETED = 0
    INVALID_REQUEST = 1
    BUSY = 2
    FAILED = 3

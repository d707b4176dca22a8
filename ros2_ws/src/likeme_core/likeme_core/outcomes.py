"""Who acted and how a motion ended, with the numbers of likeme_msgs."""

from __future__ import annotations

from enum import IntEnum


class Actor(IntEnum):
    """Who acted; the numbers of likeme_msgs/Outcome."""

    ROBOT = 0
    HUMAN = 1
    NOBODY = 2


class MotionOutcome(IntEnum):
    """How the arm says a motion ended; the numbers of likeme_msgs/ExecuteAction."""

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

    @property
    def moved(self) -> bool:
        """Whether the arm may have moved, so that the camera decides what became of the object."""
        return self <= MotionOutcome.HELD or self is MotionOutcome.FAILED

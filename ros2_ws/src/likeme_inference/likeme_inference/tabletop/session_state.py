"""The state of an imitation session as a value that can be kept and taken up again."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum, auto

from likeme_core.observations import Demonstration, TableSnapshot
from likeme_core.outcomes import Actor, MotionOutcome
from likeme_inference.tabletop.values import Decision


class Phase(Enum):
    """Phase of a session; see the diagram of session.py."""

    IDLE = auto()
    TURN = auto()
    ACTING = auto()
    ASKING = auto()
    CONFIRMING = auto()


@dataclass
class SessionState:
    """All that a session knows beside its model and its settings. Stamps in ns.

    Attributes:
        phase: the current one.
        decision: the last decision, and the one under way while ACTING, ASKING or CONFIRMING.
        decisions: id of the last decision.
        demonstration: that is imitated.
        spent: actions carried out for it.
        turn_from: stamp of the demonstration, or of its being put back.
        at_goal_reported: whether the decision AT_GOAL was made for it.
        put_back: whether the object was seen being put back.
        off_goal_since: stamp since which the object is settled off the goal.
        latest, last_view: newest table state and its stamp.
        actor: who carries out the decision.
        motion, motion_end: how the motion of the decision ended, and when.
        resumed_at: stamp of the first table state after a restart, from which a timeout counts
            anew; None: it has not come yet; 0: there was no restart.
        closed: object of the last decision that is over, and when it was.
    """

    phase: Phase = Phase.IDLE
    decision: Decision | None = None
    decisions: int = 0
    demonstration: Demonstration | None = None
    spent: int = 0
    turn_from: int = 0
    at_goal_reported: bool = False
    put_back: bool = False
    off_goal_since: int | None = None
    latest: TableSnapshot | None = None
    last_view: int = 0
    actor: Actor = Actor.NOBODY
    motion: MotionOutcome | None = None
    motion_end: int = 0
    resumed_at: int | None = 0
    closed: tuple[str, int] | None = None

    def copy(self) -> SessionState:
        """A copy, to go back to."""
        return replace(self)

    def differs(self, other: SessionState) -> bool:
        """Whether it differs in more than what the next table states bring again."""
        return self._lasting() != other._lasting()

    def _lasting(self) -> SessionState:
        return replace(self, latest=None, last_view=0, off_goal_since=None, resumed_at=0)

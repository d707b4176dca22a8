"""The state of an imitation session as a value that can be kept and taken up again."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import Enum, auto

from likeme_core.observations import Demonstration, TableSnapshot
from likeme_core.outcomes import Actor, MotionOutcome
from likeme_core.tabletop import State
from likeme_inference.tabletop.promise import Promise
from likeme_inference.tabletop.values import BlockedAction, Decision, TableGoal


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
        blocked: actions that the arm did not begin for it, as they were not free.
        named: the goal that an operator named for it.
        table: the joint goal that is imitated.
        done: objects of it that had their turn.
        turn_from: stamp of the demonstration, or of its being put back.
        at_goal_reported: whether the decision AT_GOAL was made for it.
        put_back: whether the object was seen being put back.
        off_goal_since: stamp since which the object is settled off the goal.
        latest, last_view: newest table state and its stamp.
        actor: who carries out the decision.
        motion, motion_end: how the motion of the decision ended, and when.
        resumed_at: stamp of the first table state after a restart or a pause, from which a timeout
            counts anew; None: it has not come yet; 0: there was none.
        closed: object of the last decision that is over, and when it was.
        suspended: open questions (ASKING), oldest first, and the turn (TURN) that the answer to
            one of them interrupted; none of them has any `suspended` or `latest`.
        promise: that is kept, once it was asked for (older records lack it).
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
    suspended: tuple[SessionState, ...] = ()
    promise: Promise | None = field(default=None, metadata={'added': True})
    blocked: tuple[BlockedAction, ...] = field(default=(), metadata={'added': True})
    named: State | None = field(default=None, metadata={'added': True})
    table: TableGoal | None = field(default=None, metadata={'added': True})
    done: tuple[str, ...] = field(default=(), metadata={'added': True})

    @property
    def questions(self) -> tuple[Decision, ...]:
        """The decisions whose questions are open, oldest first."""
        asking = (each for each in (*self.suspended, self) if each.phase is Phase.ASKING)
        decisions = (each.decision for each in asking if each.decision is not None)
        return tuple(sorted(decisions, key=lambda decision: decision.id))

    def question(self, name: str) -> SessionState | None:
        """The state in which the question about an object is open; None: there is none.

        There is one at most: what is shown of the object meanwhile is the help that was asked for.
        """
        for each in (self, *self.suspended):
            if each.phase is Phase.ASKING and each.decision and each.decision.object == name:
                return each
        return None

    def copy(self) -> SessionState:
        """A copy, to go back to."""
        return replace(self)

    def differs(self, other: SessionState) -> bool:
        """Whether it differs in more than what the next table states bring again."""
        return self._lasting() != other._lasting()

    def _lasting(self) -> SessionState:
        return replace(self, latest=None, last_view=0, off_goal_since=None, resumed_at=0)

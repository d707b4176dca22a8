"""What was received so far, as far as policies look back."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from typing import Any, Generic, TypeVar

from likeme_core.stamps import stamp_ns

#: Kinds of a decision, see likeme_msgs/Decision.
EXECUTE, ASK_HUMAN, AT_GOAL, NO_ACTION = range(4)
#: States of a motion and its actors, see likeme_msgs/Motion.
UNDER_WAY, ENDED = 1, 2
ROBOT, HUMAN, NOBODY = range(3)
#: Results, see likeme_msgs/Outcome.
REACHED, MISSED, NOT_SEEN, ARM_FAILED, SKIPPED = range(5)
#: Outcomes of motions, see likeme_msgs/ExecuteAction.
COMPLETED, HELD, LOST = 0, 3, 13
#: Those after which an object may be elsewhere: COMPLETED ... HELD, FAILED, LOST.
MOVED = (0, 1, 2, 3, 10, 13)
#: Kinds of heard inputs, see likeme_msgs/Heard, and answers, see likeme_msgs/AskHuman.
HEARD_TABLE, HEARD_DEMONSTRATION, HEARD_MOTION, HEARD_ANSWER, HEARD_SILENCE = range(5)
DONE_BY_HAND, TRY_ANYWAY, SKIP = range(3)
#: A missing action or motion outcome; the state of an object that is not seen.
NONE = UNKNOWN = 255
#: A stamp that goes back by more means that time began anew (a bag, another camera), ns.
TIME_JUMP = 1_000_000_000

Value = TypeVar('Value')


class Recent(OrderedDict[Any, Value], Generic[Value]):
    """The latest entries, as many as `limit`."""

    def __init__(self, limit: int) -> None:
        super().__init__()
        self._limit = limit

    def __setitem__(self, key: Any, value: Value) -> None:
        super().__setitem__(key, value)
        self.move_to_end(key)
        if len(self) > self._limit:
            self.popitem(last=False)


class Seen:
    """The messages that policies look back to; updated after the policies have read each.

    Attributes:
        world: the last World.
        tables: table states by stamp, ns.
        newest_table: the last one.
        demonstrations, beliefs: by stamp (ns) and object.
        decisions, outcomes: by the decision's id; the last one is the latest.
        answers: answers that the session took, by the decision's id.
        motions: the last report of each motion by its id.
        hold: the last HoldState of the keeper, and when it came and when it last changed, s.
        first_stamp: the first stamp of a table state, ns; what is older was not watched.
    """

    def __init__(self) -> None:
        self.world: Any = None
        self.tables: Recent[Any] = Recent(1000)
        self.newest_table: Any = None
        self.demonstrations: Recent[Any] = Recent(100)
        self.beliefs: Recent[Any] = Recent(100)
        self.decisions: Recent[Any] = Recent(100)
        self.outcomes: Recent[Any] = Recent(100)
        self.answers: Recent[int] = Recent(100)
        self.motions: Recent[Any] = Recent(1000)
        self.hold: Any = None
        self.hold_heard, self.hold_changed = 0.0, 0.0
        self.first_stamp: int | None = None
        self._update: dict[str, Callable[[Any, float], None]] = {
            'world': self._on_world,
            'table_state': self._on_table_state,
            'demonstration': self._on_demonstration,
            'goal_belief': self._on_belief,
            'decision': self._on_decision,
            'heard': self._on_heard,
            'outcome': self._on_outcome,
            'motion': self._on_motion,
            'cell/hold_state': self._on_hold_state,
        }

    @property
    def decision(self) -> Any:
        """The latest decision; None before the first."""
        return next(reversed(self.decisions.values()), None)

    @property
    def open_decision(self) -> Any:
        """The decision to act or to ask that has no outcome yet; None if there is none."""
        latest = self.decision
        if latest is None or latest.kind not in (EXECUTE, ASK_HUMAN):
            return None
        return None if latest.id in self.outcomes else latest

    @property
    def asking(self) -> Any:
        """The latest decision, if it asks and has no outcome, or was skipped; None if not.

        An answer is acknowledged after the outcome that it leads to.
        """
        latest = self.decision
        if latest is None or latest.kind != ASK_HUMAN:
            return None
        outcome = self.outcomes.get(int(latest.id))
        return latest if outcome is None or outcome.result == SKIPPED else None

    def is_repeated(self, decision: Any) -> bool:
        """Whether a decision was published before, as by a node that was restarted."""
        known = self.decisions.get(int(decision.id))
        return known is not None and (stamp_of(known), known.object, known.kind) == (
            stamp_of(decision), decision.object, decision.kind
        )  # fmt: skip

    def update(self, topic: str, message: Any, now: float) -> None:
        """Remember a message, received at `now`."""
        if topic in self._update:
            self._update[topic](message, now)

    def _on_world(self, message: Any, _: float) -> None:
        self.world = message

    def _on_table_state(self, message: Any, _: float) -> None:
        stamp = stamp_of(message)
        self.tables[stamp] = self.newest_table = message
        if self.first_stamp is None:
            self.first_stamp = stamp

    def _on_demonstration(self, message: Any, _: float) -> None:
        self.demonstrations[stamp_of(message), message.object] = message

    def _on_belief(self, message: Any, _: float) -> None:
        self.beliefs[stamp_of(message), message.object] = message

    def _on_decision(self, message: Any, _: float) -> None:
        number = int(message.id)
        if not self.is_repeated(message):
            # An id that is given again, by a node that has forgotten its last decisions.
            self.outcomes.pop(number, None)
            self.answers.pop(number, None)
        self.decisions[number] = message

    def _on_outcome(self, message: Any, _: float) -> None:
        self.outcomes[int(message.decision_id)] = message

    def _on_heard(self, message: Any, _: float) -> None:
        asking = self.asking
        if message.kind == HEARD_ANSWER and not message.refused and asking is not None:
            self.answers[int(asking.id)] = int(message.answer)

    def _on_motion(self, message: Any, _: float) -> None:
        self.motions[message.id] = message

    def _on_hold_state(self, message: Any, now: float) -> None:
        if self.hold is None or self.hold.held != message.held:
            self.hold_changed = now
        self.hold, self.hold_heard = message, now


def stamp_of(message: Any) -> int:
    """The stamp of a message's header, ns."""
    return stamp_ns(message.header.stamp)


def state_in(table: Any, name: str) -> int | None:
    """The region of an object in a table state; None if it is not listed, or UNKNOWN."""
    for item in table.objects:
        if item.name == name:
            return None if item.state == UNKNOWN else int(item.state)
    return None

"""What was received so far, as far as policies look back."""

from __future__ import annotations

import json
from collections import OrderedDict, deque
from collections.abc import Callable
from typing import Any, Generic, TypeVar

from likeme_core.stamps import stamp_ns

#: Kinds of a decision, see likeme_msgs/Decision.
EXECUTE, ASK_HUMAN, AT_GOAL, NO_ACTION = range(4)
#: States of a motion and its actors, see likeme_msgs/Motion.
UNDER_WAY, ENDED = 1, 2
ROBOT, HUMAN, NOBODY = range(3)
#: Results, see likeme_msgs/Outcome.
REACHED, MISSED, NOT_SEEN, ARM_FAILED, SKIPPED, GOAL_NAMED = range(6)
#: Outcomes of motions, see likeme_msgs/ExecuteAction.
COMPLETED, HELD, LOST, NOT_FREE = 0, 3, 13, 14
#: Those after which an object may be elsewhere: COMPLETED ... HELD, FAILED, LOST.
MOVED = (0, 1, 2, 3, 10, 13)
#: Kinds of heard inputs, see likeme_msgs/Heard, and answers, see likeme_msgs/AskHuman.
HEARD_TABLE, HEARD_DEMONSTRATION, HEARD_MOTION, HEARD_ANSWER, HEARD_SILENCE = range(5)
DONE_BY_HAND, TRY_ANYWAY, SKIP, NAME_GOAL = range(4)
#: A missing action or motion outcome; the state of an object that is not seen.
NONE = UNKNOWN = 255
#: A decision that asks by the threshold, as records of decisions name it.
THRESHOLD = 'THRESHOLD'
#: A stamp that goes back by more means that time began anew (a bag, another camera), ns.
TIME_JUMP = 1_000_000_000
#: Gaps in the messages of a topic that are remembered.
GAPS_KEPT = 10
#: s after a gap in which messages may still follow from what was missed.
FOLLOWS = 0.5

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
        joint_goals: the last belief by stamp of the demonstration (ns) and object.
        decisions, outcomes: by the decision's id; the last one is the latest.
        asking: what decided whether a decision asks (tabletop.asking.Asking), by its id, as far
            as records of decisions tell.
        answers: answers that the session took, by the decision's id.
        motions: the last report of each motion by its id.
        hold: the last HoldState of the keeper.
        hold_heard, hold_changed: when it, and its last change, had arrived at the latest, s.
        first_stamp: the first stamp of a table state, ns; what is older was not watched.
    """

    def __init__(self) -> None:
        self.world: Any = None
        self.tables: Recent[Any] = Recent(1000)
        self.newest_table: Any = None
        self.demonstrations: Recent[Any] = Recent(100)
        self.beliefs: Recent[Any] = Recent(100)
        self.joint_goals: Recent[Any] = Recent(1000)
        self.decisions: Recent[Any] = Recent(100)
        self.outcomes: Recent[Any] = Recent(100)
        self.asking: Recent[str] = Recent(100)
        self.answers: Recent[int] = Recent(100)
        self.motions: Recent[Any] = Recent(1000)
        self.hold: Any = None
        self.hold_heard, self.hold_changed = 0.0, 0.0
        self.first_stamp: int | None = None
        self._gaps: dict[str, deque[tuple[float, float]]] = {}
        self._update: dict[str, Callable[[Any, float], None]] = {
            'world': self._on_world,
            'table_state': self._on_table_state,
            'demonstration': self._on_demonstration,
            'goal_belief': self._on_belief,
            'joint_goal_belief': self._on_joint_belief,
            'decision_record': self._on_record,
            'decision': self._on_decision,
            'heard': self._on_heard,
            'outcome': self._on_outcome,
            'motion': self._on_motion,
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

    def is_open(self, number: int) -> bool:
        """Whether a decision to act or to ask has no outcome yet."""
        decision = self.decisions.get(number)
        if decision is None or decision.kind not in (EXECUTE, ASK_HUMAN):
            return False
        return number not in self.outcomes

    def answered(self, heard: Any) -> Any:
        """The decision that an answer is about: it asks and has no outcome, or the answer's.

        None if there is none. An answer is acknowledged after the outcome that it leads to. One
        that was recorded before there could be several questions is about the latest.
        """
        name = getattr(heard, 'object', '')
        about = [each for each in self.decisions.values() if each.object == name or not name]
        asked = about[-1] if about else None
        if asked is None or asked.kind != ASK_HUMAN:
            return None
        outcome = self.outcomes.get(int(asked.id))
        return asked if outcome is None or outcome.result in (SKIPPED, GOAL_NAMED) else None

    def by_threshold(self, decision: Any) -> bool:
        """Whether a decision compares with the threshold alone, as in the paper."""
        return self.asking.get(int(decision.id), THRESHOLD) == THRESHOLD

    def was_not_free(self, decision: Any) -> bool:
        """Whether the arm did not begin a decision's action for the same demonstration before."""
        wanted = _attempt(decision)
        return any(
            outcome.motion_outcome == NOT_FREE and number in self.decisions
            and _attempt(self.decisions[number]) == wanted
            for number, outcome in self.outcomes.items()
        )  # fmt: skip

    def is_repeated(self, decision: Any) -> bool:
        """Whether a decision was published before, as by a node that was restarted."""
        known = self.decisions.get(int(decision.id))
        return known is not None and (stamp_of(known), known.object, known.kind) == (
            stamp_of(decision), decision.object, decision.kind
        )  # fmt: skip

    def update(self, topic: str, message: Any, now: float, arrived: float | None = None) -> None:
        """Remember a message of `now`; `arrived`: see PolicyMonitor.hear."""
        if topic == 'cell/hold_state':
            self._on_hold_state(message, now if arrived is None else max(now, arrived))
        elif topic in self._update:
            self._update[topic](message, now)

    def miss(self, topic: str, since: float, until: float) -> None:
        """Remember that messages of a topic between two times were published, and not received."""
        self._gaps.setdefault(topic, deque(maxlen=GAPS_KEPT)).append((since, until))

    def missed(self, topic: str, now: float) -> bool:
        """Whether what is sent now may follow from messages that were not received."""
        gaps = self._gaps.get(topic, ())
        return any(since <= now <= until + FOLLOWS for since, until in gaps)

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

    def _on_joint_belief(self, message: Any, _: float) -> None:
        for name in message.objects if message.stopped else ():
            self.joint_goals[stamp_ns(message.demonstration), name] = message

    def _on_record(self, message: Any, _: float) -> None:
        try:
            record = json.loads(message.data)
            self.asking[int(record['decision']['id'])] = str(record['settings']['asking'])
        except (ValueError, KeyError, TypeError):
            # Of a version that asks by the threshold alone.
            return

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
        if message.kind != HEARD_ANSWER or message.refused:
            return
        asked = self.answered(message)
        if asked is not None:
            self.answers[int(asked.id)] = int(message.answer)

    def _on_motion(self, message: Any, _: float) -> None:
        self.motions[message.id] = message

    def _on_hold_state(self, message: Any, now: float) -> None:
        if self.hold is None or self.hold.held != message.held:
            self.hold_changed = now
        self.hold, self.hold_heard = message, now


def _attempt(decision: Any) -> tuple[Any, ...]:
    shown = stamp_ns(decision.demonstration)
    return shown, decision.object, decision.x_i, decision.action


def stamp_of(message: Any) -> int:
    """The stamp of a message's header, ns."""
    return stamp_ns(message.header.stamp)


def state_in(table: Any, name: str) -> int | None:
    """The region of an object in a table state; None if it is not listed, or UNKNOWN."""
    for item in table.objects:
        if item.name == name:
            return None if item.state == UNKNOWN else int(item.state)
    return None

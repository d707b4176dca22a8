"""The events of a cell as they are heard."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.node import Node

from likeme_core.ros.qos import LATCHED, kept
from likeme_core.ros.time import stamp_ns, steady_clock
from likeme_core.ros.world import WorldNames
from likeme_msgs.msg import (
    Decision,
    Demonstration,
    GoalBelief,
    Heard,
    HoldState,
    JointGoalBelief,
    Motion,
    Outcome,
)
from likeme_operator.ros.cell_events import (
    CellEvent,
    answer_event,
    belief_event,
    decision_event,
    demonstration_event,
    hold_event,
    joint_belief_event,
    motion_event,
    outcome_event,
)

#: s after the start in which what is kept for late subscribers arrives.
EARLIER = 1.0


class EventStream:
    """Subscribes to what tells of events, and passes each on.

    Subscribes:
        demonstration (Demonstration), goal_belief (GoalBelief), joint_goal_belief
        (JointGoalBelief), decision (Decision), outcome (Outcome), heard (Heard), motion (Motion),
        cell/holds (HoldState)

    Attributes:
        asked: id of the newest decision that asked about an object, by its name.
    """

    def __init__(
        self,
        node: Node,
        names: Callable[[], WorldNames],
        take: Callable[[CellEvent, bool], None],
        earlier: bool = False,
    ) -> None:
        """take: gets each event, and whether it may have happened before this node was there.

        earlier: whether those that happened before are passed on.
        """
        self._names, self._take = names, take
        # None once all of these were passed on; each with its stamp.
        self._before: list[tuple[int, CellEvent]] | None = []
        self._earlier = earlier
        self.asked: dict[str, int] = {}
        self._hold: tuple[bool, str, str] | None = None
        for kind, topic, qos, callback in (
            (Demonstration, 'demonstration', 10, self._on_demonstration),
            (GoalBelief, 'goal_belief', LATCHED, self._on_belief),
            (JointGoalBelief, 'joint_goal_belief', LATCHED, self._on_joint_belief),
            (Decision, 'decision', LATCHED, self._on_decision),
            (Outcome, 'outcome', LATCHED, self._on_outcome),
            (Heard, 'heard', 100, self._on_heard),
            (Motion, 'motion', kept(100), self._on_motion),
            (HoldState, 'cell/holds', kept(16), self._on_hold),
        ):
            node.create_subscription(kind, topic, callback, qos)

        self._timer = node.create_timer(EARLIER, self._pass_earlier, clock=steady_clock())

    def _pass(self, event: CellEvent, msg: Any) -> None:
        if self._before is None:
            self._take(event, False)
        else:
            self._before.append((stamp_ns(msg.header.stamp), event))

    def _pass_earlier(self) -> None:
        """Pass on what came in the first second, in the order in which it happened."""
        self._timer.cancel()
        before, self._before = self._before or [], None
        for _, event in sorted(before, key=lambda each: each[0]) if self._earlier else ():
            self._take(event, True)

    def _on_demonstration(self, msg: Demonstration) -> None:
        self._pass(demonstration_event(msg, self._names()), msg)

    def _on_belief(self, msg: GoalBelief) -> None:
        self._pass(belief_event(msg, self._names()), msg)

    def _on_joint_belief(self, msg: JointGoalBelief) -> None:
        self._pass(joint_belief_event(msg, self._names()), msg)

    def _on_decision(self, msg: Decision) -> None:
        if msg.kind == Decision.ASK_HUMAN:
            self.asked[msg.object] = msg.id
        self._pass(decision_event(msg, self._names()), msg)

    def _on_outcome(self, msg: Outcome) -> None:
        self._pass(outcome_event(msg, self._names()), msg)

    def _on_heard(self, msg: Heard) -> None:
        if msg.kind == Heard.ANSWER and not msg.refused:
            self._pass(answer_event(msg, self.asked.get(msg.object)), msg)

    def _on_motion(self, msg: Motion) -> None:
        self._pass(motion_event(msg), msg)

    def _on_hold(self, msg: HoldState) -> None:
        # A stop that is repeated until it is confirmed is one event.
        change = msg.held, msg.by, msg.reason
        if change == self._hold:
            return
        self._hold = change
        self._pass(hold_event(msg), msg)

"""Values of the desk from messages."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from likeme_core.ros.time import stamp_ns
from likeme_core.ros.world import WorldNames
from likeme_core.tabletop import Manner
from likeme_core.world.values import UNKNOWN
from likeme_inference.joint_belief import marginals_by_object
from likeme_inference.tabletop.action_selection import Kind
from likeme_inference.tabletop.values import Reply
from likeme_msgs.msg import (
    Attempt,
    Decision,
    Demonstration,
    HelpRequest,
    JointGoalBelief,
    ObjectState,
    TableState,
)
from likeme_operator.action_evidence import evidence
from likeme_operator.desk_view import (
    ANYWHERE,
    MadeDecision,
    OpenQuestion,
    QuestionKey,
    SeenObject,
    SeenTable,
    ShownAct,
    ShownAttempt,
    TableBelief,
)
from likeme_operator.what_if import WhatIf


def kind_of(msg: Decision) -> str:
    """What was decided, by its name."""
    return Kind(msg.kind).name if msg.kind in set(Kind) else '?'


def seen_object(msg: ObjectState, names: WorldNames) -> SeenObject:
    """One object of a table state."""
    known = msg.state != ObjectState.UNKNOWN
    probabilities = list(msg.state_probability)
    told = known and msg.state < len(probabilities)
    return SeenObject(
        name=msg.name,
        state=names.state(msg.state) if known else UNKNOWN,
        probability=float(probabilities[msg.state]) if told else math.nan,
        x=msg.centroid.x,
        y=msg.centroid.y,
        visible=msg.visible,
        yaw=msg.major_axis_yaw,
        length=msg.major_axis_length,
        width=msg.minor_axis_length,
    )


def seen_table(msg: TableState, names: WorldNames, age: float) -> SeenTable:
    """A table state that came `age` s ago."""
    return SeenTable(
        tuple(seen_object(item, names) for item in msg.objects),
        age,
        msg.hand_in_view,
        msg.arm_in_view,
        msg.settled,
        msg.reason,
    )


def shown_act(msg: Demonstration, names: WorldNames, age: float) -> ShownAct:
    """A demonstration that came `age` s ago."""
    manner = Manner(msg.manner).name.lower() if msg.manner in set(Manner) else '?'
    return ShownAct(
        msg.object, names.state(msg.x_i), names.state(msg.x_f), manner, msg.manner_probability, age
    )


def shown_attempt(msg: Attempt, names: WorldNames, age: float) -> ShownAttempt:
    """An attempt whose last report is `age` s old."""

    def state(number: int) -> str:
        return '' if number == Attempt.UNKNOWN else names.state(number)

    return ShownAttempt(
        msg.object,
        state(msg.x_i) or UNKNOWN,
        Manner(msg.manner).name.lower() if msg.manner in set(Manner) else '',
        msg.manner_probability,
        state(msg.direction),
        '' if msg.under_way else state(msg.x_f) or UNKNOWN,
        age,
    )


def table_belief(msg: JointGoalBelief, names: WorldNames, age: float) -> TableBelief:
    """A joint belief whose last event is `age` s old."""
    regions = (*names.states, ANYWHERE)
    marginals = marginals_by_object(msg.objects, msg.marginals, len(names.states))
    return TableBelief(
        goals=tuple(zip(msg.description, msg.probability, strict=False)),
        wanted=tuple(
            (name, tuple(sorted(zip(regions, p, strict=True), key=lambda pair: -pair[1])))
            for name, p in marginals.items()
        ),
        over=msg.stopped,
        none_of_these=msg.none_of_these,
        acts=msg.events,
        sentence=msg.sentence,
        age=age,
    )


def recorded_act(demonstration: Mapping[str, Any], now: int | None) -> ShownAct | None:
    """A demonstration of a decision's record; None: it cannot be read.

    now: stamp of the newest table state, ns.
    """
    try:
        stamp = int(demonstration['stamp'])
        return ShownAct(
            str(demonstration['object']),
            str(demonstration['x_i']),
            str(demonstration['x_f']),
            str(demonstration['manner']).lower(),
            float(demonstration['manner_probability']),
            max(0.0, ((now or stamp) - stamp) / 1e9),
        )
    except (KeyError, TypeError, ValueError):
        return None


def made_decision(
    msg: Decision, names: WorldNames, record: Mapping[str, Any] | None
) -> MadeDecision:
    """A decision, with the trials behind it if there is a record."""
    action = '' if msg.action == 255 else names.action(msg.action)
    sequential = msg.mode == 'sequential'
    return MadeDecision(
        id=msg.id,
        object=msg.object,
        x_i=names.state(msg.x_i),
        goal=names.state(msg.goal),
        kind=kind_of(msg),
        action=action,
        mode=msg.mode,
        threshold=msg.threshold,
        sure=msg.plan_value if sequential else msg.predicted_success,
        actions_left=msg.actions_left,
        goals=named(msg.goal_posterior, names.state),
        success=named(msg.success_probability, names.action),
        predicted=named(msg.predicted, names.state),
        sentence=msg.sentence,
        evidence=() if record is None else recorded_evidence(record),
    )


def named(values: Any, name: Any) -> tuple[tuple[str, float], ...]:
    """Probabilities with the names of their numbers."""
    return tuple((name(number), float(value)) for number, value in enumerate(values))


def recorded_evidence(record: Mapping[str, Any]) -> tuple[Any, ...]:
    """The evidence behind a recorded decision; none if the record cannot be read."""
    try:
        question = WhatIf(record)
    except (KeyError, ValueError, TypeError):
        return ()
    made = question.made.decision
    return () if made is None else tuple(evidence(made, question.inputs))


def question_key(msg: HelpRequest, names: WorldNames) -> QuestionKey:
    """What identifies a request."""
    return QuestionKey(msg.id, msg.object, names.action(msg.action), stamp_ns(msg.header.stamp))


def open_question(msg: HelpRequest, names: WorldNames, age: float) -> OpenQuestion:
    """A request that was made `age` s ago."""
    return OpenQuestion(
        question_key(msg, names),
        names.state(msg.x_i),
        names.state(msg.goal),
        msg.predicted_success,
        msg.threshold,
        msg.question,
        tuple(Reply(option) for option in msg.options if option in set(Reply)),
        age,
        names.states,
    )

"""What happens in a cell, an event for each message that tells of it."""

from __future__ import annotations

from typing import Any, NamedTuple

from likeme_core.outcomes import MotionOutcome
from likeme_core.ros.world import WorldNames
from likeme_core.tabletop import Manner
from likeme_inference.tabletop.values import Reply, Result
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
from likeme_operator.ros.views_of_messages import kind_of


class CellEvent(NamedTuple):
    """One event.

    Attributes:
        kind: demonstration, belief, joint_belief, decision, answer, motion, outcome, hold,
            resume or node.
        sentence: for people.
        data: for programs; names instead of numbers.
    """

    kind: str
    sentence: str
    data: dict[str, Any]

    @property
    def line(self) -> str:
        """The event on one line."""
        return f'{self.kind:13} {self.sentence}'


def demonstration_event(msg: Demonstration, names: WorldNames) -> CellEvent:
    """A human act was seen."""
    manner = Manner(msg.manner).name.lower() if msg.manner in set(Manner) else '?'
    x_i, x_f = names.state(msg.x_i), names.state(msg.x_f)
    told = f'{msg.object} from {x_i} to {x_f} by {manner} (p = {msg.manner_probability:.2f}).'
    data = {'object': msg.object, 'x_i': x_i, 'x_f': x_f, 'manner': manner}
    return CellEvent('demonstration', told, data)


def belief_event(msg: GoalBelief, names: WorldNames) -> CellEvent:
    """A goal was inferred."""
    posterior = {names.state(n): float(p) for n, p in enumerate(msg.posterior)}
    told = ', '.join(f'{name} {p:.2f}' for name, p in posterior.items())
    data = {'object': msg.object, 'goal': names.state(msg.goal), 'posterior': posterior}
    return CellEvent('belief', f'{msg.object} is wanted: {told}.', data)


def joint_belief_event(msg: JointGoalBelief, names: WorldNames) -> CellEvent:
    """What is wanted of all objects was inferred; `changes`: the most probable ones."""
    count = len(msg.objects)
    rows = [msg.changes[k * count : (k + 1) * count] for k in range(len(msg.probability))]
    changes = [
        {
            'p': float(p),
            'goals': {
                name: names.state(g)
                for name, g in zip(msg.objects, row, strict=True)
                if g != JointGoalBelief.UNKNOWN
            },
        }
        for p, row in zip(msg.probability, rows, strict=True)
    ]
    data = {
        'stopped': msg.stopped,
        'changes': changes,
        'none_of_these': msg.none_of_these,
        'events': msg.events,
    }
    return CellEvent('joint_belief', msg.sentence, data)


def decision_event(msg: Decision, names: WorldNames) -> CellEvent:
    """A decision was made."""
    data = {
        'id': msg.id,
        'object': msg.object,
        'x_i': names.state(msg.x_i),
        'goal': names.state(msg.goal),
        'choice': kind_of(msg),
        'action': None if msg.action == 255 else names.action(msg.action),
        'p': None if msg.action == 255 else msg.predicted_success,
        'mode': msg.mode,
        'threshold': msg.threshold,
        'sentence': msg.sentence,
    }
    return CellEvent('decision', f'{msg.id}: {msg.sentence}', data)


def answer_event(msg: Heard, request_id: int | None) -> CellEvent:
    """An operator answered."""
    reply = Reply(msg.answer).name if msg.answer in set(Reply) else '?'
    about = 'A request' if request_id is None else f'Request {request_id}'
    data = {'request': request_id, 'answer': reply, 'by': msg.message}
    return CellEvent('answer', f'{about} was answered by {msg.message}: {reply}.', data)


def outcome_event(msg: Outcome, names: WorldNames) -> CellEvent:
    """A decision ended."""
    result = Result(msg.result).name if msg.result in set(Result) else '?'
    data = {
        'decision': msg.decision_id,
        'object': msg.object,
        'result': result,
        'goal': names.state(msg.goal),
        'sentence': msg.sentence,
    }
    return CellEvent('outcome', f'{msg.decision_id}: {result}. {msg.sentence}', data)


def motion_event(msg: Motion) -> CellEvent:
    """A motion began or ended."""
    who = 'robot' if msg.actor == Motion.ROBOT else 'person'
    ended = msg.state == Motion.ENDED
    known = ended and msg.outcome in set(MotionOutcome)
    outcome = MotionOutcome(msg.outcome).name if known else None
    told = f'{who}: {msg.action} {msg.object} ' + (f'ended {outcome}.' if ended else 'begins.')
    data = {
        'id': msg.id,
        'actor': who,
        'object': msg.object,
        'action': msg.action,
        'ended': ended,
        'outcome': outcome,
    }
    return CellEvent('motion', told, data)


def hold_event(msg: HoldState) -> CellEvent:
    """Motion was held, or allowed again."""
    by, reason = msg.by or '?', f': {msg.reason}' if msg.reason else ''
    kind = 'hold' if msg.held else 'resume'
    return CellEvent(kind, f'by {by}{reason}', {'by': msg.by, 'reason': msg.reason})

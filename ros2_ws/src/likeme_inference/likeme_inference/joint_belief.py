"""What is believed of a person's joint goal after an event, and the sentence about it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

from likeme_core.observations import ObservedAttempt
from likeme_core.tabletop import State
from likeme_core.world import World
from likeme_inference.tabletop.arrays import FloatArray
from likeme_inference.tabletop.goal_space import JointGoal
from likeme_inference.tabletop.values import ObjectGoal, TableGoal
from likeme_inference.value_json import from_json, to_json

#: Required changes that are told, the most probable first.
MOST_TOLD = 10
_TIMES = {1: 'once', 2: 'twice'}


@dataclass(frozen=True, eq=False)
class JointBelief:
    """The fields of likeme_msgs/JointGoalBelief, and what another observer needs to go on.

    Attributes:
        stamp, frame: of the event, or of the table state in which the person had stopped.
        demonstration: stamp of the first event.
        stopped: whether the person has stopped.
        objects: their names, the order of all entries.
        start: where each object was before the demonstration; None: not seen.
        changes: the most probable required changes and their probabilities, see
            `Watcher.changes`.
        descriptions: of the changes, in words.
        marginals: P(goal of each object), shape [object, x + 1]; the last is "don't care".
        p_value: see `Watcher.p_value`.
        none_of_these: whether the test of `level` rejects that the person has one of the goals.
        level: of the test.
        rationality: expected of the person (geometric mean).
        events: taken in.
        unexplained: of them, by no hypothesis.
        sentence: for people.
        attempt: the event; None: the person has stopped.
        person: P(kind of person), shape [person]: before the first event, and after the stop;
            None: nothing is known before the first, and of the events between.
    """

    stamp: int
    frame: str
    demonstration: int
    stopped: bool
    objects: tuple[str, ...]
    start: tuple[State | None, ...]
    changes: tuple[tuple[JointGoal, float], ...]
    descriptions: tuple[str, ...]
    marginals: FloatArray
    p_value: float
    none_of_these: bool
    level: float
    rationality: float
    events: int
    unexplained: int
    sentence: str
    attempt: ObservedAttempt | None = None
    person: FloatArray | None = None


@dataclass(frozen=True)
class ToldEvent:
    """What a restarted observer reads of a logged belief; see the same fields of JointBelief."""

    stamp: int
    demonstration: int
    stopped: bool
    objects: tuple[str, ...]
    start: tuple[State | None, ...]
    attempt: ObservedAttempt | None
    person: tuple[float, ...] | None


def marginals_by_object(
    objects: Sequence[str], marginals: Sequence[float], states: int
) -> dict[str, list[float]]:
    """`marginals` of a message by object: P of each of `states` regions, then of "don't care".

    Empty if there are not so many for each object.
    """
    size = states + 1
    if len(marginals) != size * len(objects):
        return {}
    flat = [float(p) for p in marginals]
    return {name: flat[k * size : (k + 1) * size] for k, name in enumerate(objects)}


def belief_record(belief: JointBelief, world: World) -> dict[str, Any]:
    """What the decision log has of a belief, as JSON values; states by their names."""
    return {
        'stamp': belief.stamp,
        'demonstration': belief.demonstration,
        'stopped': belief.stopped,
        'objects': list(belief.objects),
        'start': to_json(belief.start),
        'changes': [
            [[None if g is None else world.states[g].name for g in change], probability]
            for change, probability in belief.changes
        ],
        # [object, x + 1]; the last is "don't care".
        'marginals': belief.marginals.tolist(),
        'p_value': belief.p_value,
        'none_of_these': bool(belief.none_of_these),
        'rationality': belief.rationality,
        'events': belief.events,
        'unexplained': belief.unexplained,
        'sentence': belief.sentence,
        'attempt': to_json(belief.attempt),
        'person': None if belief.person is None else belief.person.tolist(),
    }


def told_events(records: Sequence[Mapping[str, Any]], world: World) -> tuple[ToldEvent, ...]:
    """The events of the newest demonstration of some records; none of it in older logs.

    records: see belief_record, oldest first.

    Raises:
        ValueError, KeyError, TypeError: one is not what was written.
    """
    newest = records[-1]['demonstration'] if records else None
    names = [field.name for field in fields(ToldEvent)]
    return tuple(
        from_json(ToldEvent, {name: record[name] for name in names}, world)
        for record in records
        if record['demonstration'] == newest and 'attempt' in record
    )


def table_goal(belief: JointBelief, wait: float) -> TableGoal | None:
    """The joint goal to imitate; None: nobody has stopped, or nothing need change.

    Its objects are those that the most probable required changes name. Each has P(G) given that it
    must change. wait: s, see TableGoal.
    """
    change, _ = belief.changes[0]
    if not belief.stopped or belief.none_of_these or all(goal is None for goal in change):
        return None
    goals = []
    for name, wanted, x_i, row in zip(
        belief.objects, change, belief.start, belief.marginals, strict=True
    ):
        if wanted is not None:
            posterior = row[:-1] / row[:-1].sum()
            goals.append(ObjectGoal(name, x_i, tuple(posterior.tolist())))
    return TableGoal(
        belief.stamp, belief.frame, belief.demonstration, tuple(goals), wait, belief.sentence
    )


def told(
    seen: Sequence[ObservedAttempt], stopped: bool, objects: Sequence[str],
    change: JointGoal, described: str, probability: float, none_of_these: bool,
) -> str:  # fmt: skip
    """The sentence about a belief.

    Args:
        seen: the events of the demonstration, the latest last.
        stopped: whether the person has stopped.
        objects: names of the objects.
        change: the most probable required changes, of each object.
        described: the same in words.
        probability: of them.
        none_of_these: whether the person has none of the goals.
    """
    begin = 'The person has stopped' if stopped else _deed(seen)
    if none_of_these:
        return f'{begin}: I see no goal in what was done.'
    still = [f'the {name}' for name, g in zip(objects, change, strict=True) if g is None]
    if len(still) == len(objects):
        return f'{begin}: I believe that nothing need change ({probability:.2f}).'
    rest = f', and that {_listed(still)} need not change' if still else ''
    return f'{begin}: I believe {described} ({probability:.2f}){rest}.'


def _deed(seen: Sequence[ObservedAttempt]) -> str:
    act = seen[-1]
    what, towards = (
        f'the {act.object}',
        f' to {act.direction}' if act.direction is not None else '',
    )
    if act.under_way:
        return f'The person is moving {what}{towards}'
    if act.x_f is None:
        return f'The person moved {what}{towards}, and I did not see where it ended'
    if act.x_f != act.x_i:
        return f'The person moved {what} from {act.x_i} to {act.x_f}'
    same = [
        e for e in seen
        if not e.under_way and (e.object, e.x_i, e.x_f, e.direction)
        == (act.object, act.x_i, act.x_f, act.direction)
    ]  # fmt: skip
    often = _TIMES.get(len(same), f'{len(same)} times')
    if act.direction is None:
        return f'The person moved {what} {often}, and left it {act.x_f}'
    return f'The person tried {often} to move {what}{towards}, in vain'


def _listed(names: Sequence[str]) -> str:
    *first, last = names
    return f'{", ".join(first)} and {last}' if first else last

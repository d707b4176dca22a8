"""What a policy is: one sentence about the topics, and the messages that break it.

A policy is a class. The first line of its docstring is its sentence, and it reads the topics that
it has a method for: `on_cell_holds` reads `cell/holds`. Each method yields one sentence a
violation. Messages are read by their fields alone: rclpy's, rosbags' and plain objects all serve.
Times are s of the clock by which the messages were sent or received; memory is bounded.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

from likeme_replay.policies.seen import Seen

#: Topics that policies may read, with their types. `questions` is no topic of the graph: it is the
#: answer of `ask_human` to LIST, where somebody asks for it.
TOPICS = {
    'world': 'likeme_msgs/msg/World',
    'frame_done': 'likeme_msgs/msg/FrameDone',
    'table_state': 'likeme_msgs/msg/TableState',
    'demonstration': 'likeme_msgs/msg/Demonstration',
    'heard': 'likeme_msgs/msg/Heard',
    'goal_belief': 'likeme_msgs/msg/GoalBelief',
    'joint_goal_belief': 'likeme_msgs/msg/JointGoalBelief',
    'decision_record': 'std_msgs/msg/String',
    'decision': 'likeme_msgs/msg/Decision',
    'outcome': 'likeme_msgs/msg/Outcome',
    'motion': 'likeme_msgs/msg/Motion',
    'cell/hold_state': 'likeme_msgs/msg/HoldState',
    'cell/holds': 'likeme_msgs/msg/HoldState',
    'heartbeat': 'likeme_msgs/msg/Heartbeat',
    'joint_states': 'sensor_msgs/msg/JointState',
    'parameter_events': 'rcl_interfaces/msg/ParameterEvent',
}
QUESTIONS = 'questions'

Found = Iterator[str]
Handler = Callable[[Any, float], Found]


@dataclass(frozen=True)
class Bounds:
    """Bounds of the policies, s unless said otherwise.

    Attributes:
        reaction: from a hold to the last control step of a motion, with the way of the messages.
        joint_speed: greatest speed of a joint at rest, rad/s.
        keeper_silence: longest time without the keeper's state in which motion may begin.
        keeper_patience: time after which a motion without a keeper has ended.
        silence: without a heartbeat, after which a node counts as dead.
        recovery: from a node's death to its next run.
        arm_wait: from a decision to act, or an answer, to the motion or its refusal.
        motion: from the begin of a motion to its end.
        outcome: from the end of a motion, or an answer, to the outcome.
        question: from a decision to ask to its question in `ask_human`.
        told: from a change of the hold to its report on `cell/holds`.
        taken: from a demonstration to its acknowledgement by the session, which waits while its
            log cannot be written.
    """

    reaction: float = 0.1
    joint_speed: float = 0.02
    keeper_silence: float = 0.4
    keeper_patience: float = 3.0
    silence: float = 0.25
    recovery: float = 10.0
    arm_wait: float = 15.0
    motion: float = 120.0
    outcome: float = 30.0
    question: float = 10.0
    told: float = 2.0
    taken: float = 10.0


class Violation(NamedTuple):
    """A policy that was broken: when (s), and how."""

    policy: str
    time: float
    sentence: str


class Policy:
    """One policy; `seen` is what was received before the message at hand."""

    def __init__(self, seen: Seen, bounds: Bounds) -> None:
        self.seen, self.bounds = seen, bounds

    @classmethod
    def name(cls) -> str:
        """Its id: the name of the class in snake case."""
        return re.sub(r'(?<!^)(?=[A-Z])', '_', cls.__name__).lower()

    @classmethod
    def sentence(cls) -> str:
        """What it demands."""
        return (cls.__doc__ or '').split('\n\n')[0].replace('\n    ', ' ').strip()

    @classmethod
    def topics(cls) -> tuple[str, ...]:
        """What it reads."""
        return tuple(topic for topic in (*TOPICS, QUESTIONS) if hasattr(cls, method_of(topic)))

    @property
    def regions(self) -> int | None:
        """Number of regions of the world; None while it is not known."""
        return None if self.seen.world is None else len(self.seen.world.regions)

    def tick(self, now: float) -> Found:
        """Time has passed: violations by what has not come."""
        yield from ()


def method_of(topic: str) -> str:
    """The method of a policy that takes a topic's messages."""
    return 'on_' + topic.replace('/', '_')


class Deadlines:
    """What is expected, by key, and by when; the latest 100."""

    def __init__(self) -> None:
        self._open: dict[Any, tuple[float, str]] = {}

    def __contains__(self, key: Any) -> bool:
        return key in self._open

    def expect(self, key: Any, deadline: float, sentence: str) -> None:
        """Expect something by a time, s; `sentence` says that it has not come."""
        self._open[key] = deadline, sentence
        if len(self._open) > 100:
            self._open.pop(next(iter(self._open)))

    def meet(self, key: Any) -> None:
        """It has come, or is not expected any more."""
        self._open.pop(key, None)

    def postpone(self, deadline: float) -> None:
        """Expect nothing before a time, s."""
        for key, (known, sentence) in self._open.items():
            self._open[key] = max(known, deadline), sentence

    def clear(self) -> None:
        """Nothing is expected any more."""
        self._open.clear()

    def overdue(self, now: float) -> Found:
        """The sentences of what has not come in time; each once."""
        for key in [key for key, (deadline, _) in self._open.items() if now > deadline]:
            yield self._open.pop(key)[1]


class Expectant(Policy):
    """A policy that is broken by what has not come in time."""

    def __init__(self, seen: Seen, bounds: Bounds) -> None:
        super().__init__(seen, bounds)
        self._expected = Deadlines()

    def tick(self, now: float) -> Found:
        """The sentences of what has not come."""
        yield from self._expected.overdue(now)


def distribution(values: Any, size: int | None, what: str) -> Found:
    """A violation unless these are probabilities that sum to 1, as many as `size` says."""
    p = [float(value) for value in values]
    if size is not None and len(p) != size:
        yield f'Expected {what} as {size} numbers, got {len(p)}.'
    elif not all(value >= 0 for value in p):
        yield f'Expected {what} to be 0 or more, got {min(p):g}.'
    elif not abs(sum(p) - 1) <= SUM_TOLERANCE:
        yield f'Expected {what} to sum to 1, got {sum(p):g}.'


#: Of a sum of probabilities, as in the inputs of a session.
SUM_TOLERANCE = 1e-3
#: Of numbers that are copies of each other.
SAME = 1e-9


def close(first: Any, second: Any) -> bool:
    """Whether two sequences of numbers are equal up to rounding."""
    a, b = list(first), list(second)
    return len(a) == len(b) and all(abs(x - y) <= SAME for x, y in zip(a, b, strict=True))

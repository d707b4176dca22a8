"""Results of an imitation session, with the fields of the messages.

Stamps are ROS time in ns; `frame` is the frame_id of the header a stamp came with. Probabilities
are tuples indexed by the numbers of states or actions.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

from likeme_core.outcomes import Actor, MotionOutcome
from likeme_core.tabletop import Action, Mode, State
from likeme_inference.tabletop.action_selection import Kind
from likeme_inference.tabletop.domain import Policy


class Result(IntEnum):
    """Result of a decision; the numbers of likeme_msgs/Outcome."""

    REACHED = 0
    MISSED = 1
    NOT_SEEN = 2
    ARM_FAILED = 3
    SKIPPED = 4


class Reply(IntEnum):
    """An operator's answer; the numbers of likeme_msgs/AskHuman."""

    DONE_BY_HAND = 0
    TRY_ANYWAY = 1
    SKIP = 2


@dataclass(frozen=True)
class GoalBelief:
    """p(G | x_i, x_f) of a demonstration."""

    stamp: int
    frame: str
    object: str
    x_i: State
    x_f: State
    prior: tuple[float, ...]
    posterior: tuple[float, ...]
    goal: State
    model: str
    sentence: str


@dataclass(frozen=True)
class Decision:
    """A decision and the quantities it follows from (see action_selection.Choice)."""

    stamp: int
    frame: str
    id: int
    demonstration: int
    mode: Mode
    object: str
    x_i: State
    goal: State
    goal_posterior: tuple[float, ...]
    kind: Kind
    action: Action | None
    action_probability: tuple[float, ...]
    success_probability: tuple[float, ...]
    predicted: tuple[float, ...]
    predicted_success: float
    actions_left: int
    plan_success: tuple[float, ...]
    plan_value: float
    threshold: float
    policy: Policy
    model: str
    sentence: str


@dataclass(frozen=True)
class HelpRequest:
    """A question to the operator; `id` is that of the decision."""

    stamp: int
    frame: str
    id: int
    object: str
    x_i: State
    goal: State
    action: Action
    predicted_success: float
    threshold: float
    question: str

    @property
    def options(self) -> tuple[Reply, ...]:
        """Answers that can be given: what never worked is not tried."""
        return tuple(r for r in Reply if r is not Reply.TRY_ANYWAY or self.predicted_success > 0)


@dataclass(frozen=True)
class MotionReport:
    """Result of a call to the arm; outcome None if the arm was absent, died or did not respond."""

    outcome: MotionOutcome | None
    message: str
    finished: int = 0


@dataclass(frozen=True)
class Outcome:
    """Outcome of a decision, as observed by the camera."""

    stamp: int
    frame: str
    decision_id: int
    object: str
    x_i: State
    goal: State
    x_f: State | None
    result: Result
    actor: Actor
    action: Action | None
    predicted_success: float
    motion: MotionOutcome | None
    sentence: str


@dataclass(frozen=True)
class Remark:
    """A log message about an input that leads to no belief, decision or outcome."""

    sentence: str

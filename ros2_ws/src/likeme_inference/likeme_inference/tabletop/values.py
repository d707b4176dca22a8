"""Results of an imitation session, with the fields of the messages.

Stamps are ROS time in ns; `frame` is the frame_id of the header a stamp came with. Probabilities
are tuples indexed by the numbers of states or actions.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum

from likeme_core.outcomes import Actor, MotionOutcome
from likeme_core.tabletop import Action, Mode, State
from likeme_inference.tabletop.action_selection import Kind
from likeme_inference.tabletop.cost_planning import Question
from likeme_inference.tabletop.domain import Policy


class Result(IntEnum):
    """Result of a decision; the numbers of likeme_msgs/Outcome."""

    REACHED = 0
    MISSED = 1
    NOT_SEEN = 2
    ARM_FAILED = 3
    SKIPPED = 4
    GOAL_NAMED = 5


class Reply(IntEnum):
    """An operator's answer; the numbers of likeme_msgs/AskHuman."""

    DONE_BY_HAND = 0
    TRY_ANYWAY = 1
    SKIP = 2
    NAME_GOAL = 3


class RequestKind(IntEnum):
    """What a help request asks for; the numbers of likeme_msgs/HelpRequest."""

    HELP = 0
    WHICH_GOAL = 1
    CLEAR_THE_WAY = 2


@dataclass(frozen=True)
class ObjectGoal:
    """What is wanted of one object of a joint goal.

    Attributes:
        x_i: where it was before the demonstration; None: that was not seen.
        posterior: P(G) of it, given that it must change, indexed by the states.
    """

    object: str
    x_i: State | None
    posterior: tuple[float, ...]


@dataclass(frozen=True)
class TableGoal:
    """A joint goal, when the person has stopped; the objects that need not change are left out.

    Attributes:
        stamp, frame: of the table state in which the person had stopped.
        demonstration: stamp of its first event.
        wait: s without an act after which a person has stopped.
        sentence: for people.
    """

    stamp: int
    frame: str
    demonstration: int
    goals: tuple[ObjectGoal, ...]
    wait: float
    sentence: str


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
class Support:
    """What the success of the chosen action is known from.

    Attributes:
        trials: the object's own, of the action from x_i; object_trials: of any action.
        borrowed: objects and how many trials they are worth to it, the greatest first.
        low, high: equal-tailed 95 % credible bounds of the predicted success.
    """

    trials: int
    object_trials: int
    borrowed: tuple[tuple[str, float], ...]
    low: float
    high: float


@dataclass(frozen=True)
class ExpectedCosts:
    """Expected costs of what could be done (see cost_planning.CostChoice).

    Attributes:
        act: NaN if no plan acts.
        other: the likeliest goal beside the decision's.
    """

    act: float
    help: float
    which: float
    question: Question | None
    other: State


@dataclass(frozen=True)
class BlockedAction:
    """An action that the arm did not begin from x_i, as its place or way was not free.

    Attributes:
        why: the arm's sentence.
    """

    x_i: State
    action: Action
    why: str


@dataclass(frozen=True)
class Decision:
    """A decision and the quantities it follows from (see action_selection.Choice).

    Attributes:
        support: with a prior fitted to other objects' trials and an action, else None.
        costs: of asking by cost, else None.
        blocked: the actions that the arm did not begin from x_i, None: there is none.
        also: of a joint goal, the other objects that it would ask about, and their goals.
    """

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
    # Older decision logs lack it (value_json.ADDED).
    support: Support | None = field(default=None, metadata={'added': True})
    costs: ExpectedCosts | None = field(default=None, metadata={'added': True})
    blocked: tuple[BlockedAction, ...] | None = field(default=None, metadata={'added': True})
    also: tuple[tuple[str, State], ...] | None = field(default=None, metadata={'added': True})


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
    kind: RequestKind = field(default=RequestKind.HELP, metadata={'added': True})

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

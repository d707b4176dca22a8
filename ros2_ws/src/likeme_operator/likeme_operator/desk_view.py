"""What a desk shows of a cell at one moment: plain values, no messages.

Ages are s; positions m in base_link; names are those of the world.
"""

from __future__ import annotations

from dataclasses import dataclass

from likeme_bringup.cell_status import MotionPermission, NodeStatus
from likeme_inference.tabletop.values import Reply
from likeme_operator.action_evidence import ActionEvidence

#: Of an object that need not change.
ANYWHERE = 'anywhere'
#: s after which a person who acts, but of whom nothing is heard, is not shown as acting.
ACTING = 20.0


@dataclass(frozen=True)
class SeenObject:
    """One object as the camera saw it.

    Attributes:
        state: UNKNOWN where the frame does not tell.
        probability: of the state; NaN when UNKNOWN.
        x, y: the centroid, NaN when it was never seen.
        yaw: of the major axis, rad. length, width: along and across it.
    """

    name: str
    state: str
    probability: float
    x: float
    y: float
    visible: bool
    yaw: float = 0.0
    length: float = 0.0
    width: float = 0.0


@dataclass(frozen=True)
class SeenTable:
    """The newest table state.

    Attributes:
        age: since it was received.
        reason: why this frame tells nothing; empty: it was read.
    """

    objects: tuple[SeenObject, ...]
    age: float
    hand: bool
    arm: bool
    settled: bool
    reason: str = ''


@dataclass(frozen=True)
class ShownAct:
    """The last demonstration."""

    object: str
    x_i: str
    x_f: str
    manner: str
    manner_probability: float
    age: float


@dataclass(frozen=True)
class ShownAttempt:
    """What a person does with one object, or did last.

    Attributes:
        manner: empty: it cannot be told.
        towards: region that the object is moved towards; empty: it cannot be told.
        x_f: where it ended; empty: it is under way.
        age: of its last report, by the camera's time.
    """

    object: str
    x_i: str
    manner: str
    manner_probability: float
    towards: str
    x_f: str
    age: float


@dataclass(frozen=True)
class TableBelief:
    """What a person wants of all objects together, after each of the acts.

    Attributes:
        goals: what must change, in words, with its probability; the most probable first.
        wanted: of each object its name, and where it is wanted with which probability; ANYWHERE
            where it need not change.
        over: whether the person has stopped.
        none_of_these: whether the acts show that the person has none of the goals.
        age: of its last event, by the camera's time.
    """

    goals: tuple[tuple[str, float], ...]
    wanted: tuple[tuple[str, tuple[tuple[str, float], ...]], ...]
    over: bool
    none_of_these: bool
    acts: int
    sentence: str
    age: float


@dataclass(frozen=True)
class MadeDecision:
    """A decision and what it follows from.

    Attributes:
        goals: name of each state and its posterior.
        evidence: of each action; empty: no record was received.
        success: p of each action, for when there is no evidence.
        predicted: name of each state and its probability after the action.
        sure: what the threshold is held against.
    """

    id: int
    object: str
    x_i: str
    goal: str
    kind: str
    action: str
    mode: str
    threshold: float
    sure: float
    actions_left: int
    goals: tuple[tuple[str, float], ...]
    success: tuple[tuple[str, float], ...]
    predicted: tuple[tuple[str, float], ...]
    sentence: str
    evidence: tuple[ActionEvidence, ...] = ()


@dataclass(frozen=True)
class QuestionKey:
    """What makes a question the one that was read: nothing else is answered."""

    id: int
    object: str
    action: str
    stamp: int


@dataclass(frozen=True)
class OpenQuestion:
    """A request for help that waits for an answer.

    Attributes:
        age: since it was asked, by the camera's time.
        regions: names of the goals that can be named.
    """

    key: QuestionKey
    x_i: str
    goal: str
    predicted_success: float
    threshold: float
    question: str
    options: tuple[Reply, ...]
    age: float
    regions: tuple[str, ...] = ()


@dataclass(frozen=True)
class HistoryRow:
    """One decision and how it ended, as text.

    Attributes:
        time: of the day, as this host's clock had it.
        how: what was decided: acted, asked and what was answered.
        result: the outcome's name; empty: open.
    """

    time: str
    id: int
    object: str
    change: str
    action: str
    p: float
    how: str
    result: str


@dataclass(frozen=True)
class DeskView:
    """All of it.

    Attributes:
        domain: ROS domain.
        reached: whether any node of a cell was heard so far.
        world: label name@digest; empty: unknown.
        moving: the motion under way, in words; empty: none.
        camera_rate: table states per s.
        operators: names of the other desks' operators.
        problems: what is wrong, a sentence each.
    """

    domain: int
    reached: bool
    world: str
    motion: MotionPermission
    moving: str
    nodes: tuple[tuple[str, NodeStatus], ...]
    table: SeenTable | None
    camera_rate: float
    shown: ShownAct | None
    decision: MadeDecision | None
    questions: tuple[OpenQuestion, ...]
    history: tuple[HistoryRow, ...]
    operators: tuple[str, ...] = ()
    problems: tuple[str, ...] = ()
    believed: TableBelief | None = None
    attempted: ShownAttempt | None = None

    @property
    def acting(self) -> TableBelief | None:
        """What is believed while a person acts; None: nobody does."""
        now = self.believed
        return None if now is None or now.over or now.age > ACTING else now

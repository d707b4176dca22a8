"""The node of the desk's screen: keeps what was heard, and gives it as one view."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Mapping
from datetime import datetime
from typing import Any

from rclpy.parameter_client import AsyncParameterClient
from std_msgs.msg import Header

from likeme_bringup.cell_status import MotionPermission, node_statuses
from likeme_core.heartbeats import HOLD_TIMEOUT
from likeme_core.ros.qos import LATCHED
from likeme_core.ros.time import stamp_ns, steady_clock
from likeme_core.world import World, load_world
from likeme_core.world.values import label_of
from likeme_inference.ros.decision_records import DecisionRecordSubscriber
from likeme_msgs.msg import (
    Attempt,
    Decision,
    Demonstration,
    HelpRequest,
    HoldState,
    JointGoalBelief,
    TableState,
)
from likeme_operator.desk_problems import problems_of
from likeme_operator.desk_view import (
    DeskView,
    MadeDecision,
    OpenQuestion,
    SeenTable,
    ShownAct,
    ShownAttempt,
    TableBelief,
)
from likeme_operator.history import History
from likeme_operator.operator_node import SILENCE, OperatorNode
from likeme_operator.ros.cell_events import CellEvent
from likeme_operator.ros.event_stream import EventStream
from likeme_operator.ros.views_of_messages import (
    made_decision,
    open_question,
    recorded_act,
    seen_table,
    shown_act,
    shown_attempt,
    table_belief,
)

#: What has the label of its world.
WorldMessage = TableState | Demonstration | Attempt | JointGoalBelief
#: s between two requests for the open questions that no event causes.
LOOK_PERIOD = 1.0
#: Table states from which the camera's rate is told.
RATED = 30
REMARKS_KEPT = 50


class DeskNode(OperatorNode):
    """Keeps the newest message of what the screen shows.

    Subscribes, beside those of OperatorNode and EventStream:
        table_state (TableState), demonstration (Demonstration), attempt (Attempt),
        joint_goal_belief (JointGoalBelief), decision (Decision), decision_record (String)
    Of another world than the topic `world` tells, these are a problem and not shown.

    Attributes:
        history: decisions and how they ended.
        remarks: what an operator should read, newest last; with the monotonic time.
        records: of the newest decisions by their numbers, for what-if.
    """

    def __init__(self, by: str) -> None:
        """by: name of the operator."""
        super().__init__(by)
        self._lock = threading.Lock()
        self.history = History()
        self.remarks: deque[tuple[float, str]] = deque(maxlen=REMARKS_KEPT)
        self._table: TableState | None = None
        self._frames: deque[float] = deque(maxlen=RATED)
        self._shown: tuple[Demonstration, float] | None = None
        self._believed: JointGoalBelief | None = None
        self._attempted: Attempt | None = None
        self._decisions: dict[int, Decision] = {}
        self._made: dict[tuple[int, bool], MadeDecision] = {}
        self._pending: list[HelpRequest] = []
        self._moving = ''
        self._world: World | None = None
        self._worlds: AsyncParameterClient | None = None
        self._operators: tuple[str, ...] = ()
        self._records = DecisionRecordSubscriber(self)
        self.create_subscription(TableState, 'table_state', self._on_table, 1)
        self.create_subscription(Demonstration, 'demonstration', self._on_demonstration, 10)
        self.create_subscription(Attempt, 'attempt', self._on_attempt, 10)
        self.create_subscription(
            JointGoalBelief, 'joint_goal_belief', self._on_joint_belief, LATCHED
        )
        self.create_subscription(Decision, 'decision', self._on_decision, LATCHED)
        self._events = EventStream(self, lambda: self.names, self._on_event, earlier=True)
        self.create_timer(LOOK_PERIOD, self._look, clock=steady_clock())

    @property
    def records(self) -> Mapping[int, Mapping[str, Any]]:
        """What the newest decisions follow from."""
        return self._records.records

    @property
    def geometry(self) -> World | None:
        """The world with its areas; None: its file is not known here."""
        return self._world

    def remark(self, sentence: str) -> None:
        """Tell the operator something."""
        self.remarks.append((time.monotonic(), sentence))

    def add_earlier(self, earlier: History) -> None:
        """Add what happened before this desk was there."""
        with self._lock:
            self.history.add_earlier(earlier)

    def view(self, number: int | None = None) -> DeskView:
        """All there is to see now.

        number: of the decision that is looked at; None: the newest one.
        """
        with self._lock:
            now = time.monotonic()
            nodes = dict(self.monitor.nodes)
            silence = {name: self.monitor.silence(name, now) for name in nodes}
            statuses = node_statuses(nodes, silence, SILENCE)
            table, motion = self._seen(now), self._motion()
            decision = self._decision(number)
            return DeskView(
                domain=self.context.get_domain_id(),
                reached=bool(nodes),
                world='' if self.names.message is None else self._label(),
                motion=motion,
                moving=self._moving,
                nodes=tuple(statuses.items()),
                table=table,
                camera_rate=self._rate(now),
                shown=self._last_act(decision, now),
                decision=decision,
                questions=tuple(self._question(request) for request in self._pending),
                history=self.history.rows,
                operators=self._operators,
                problems=(*self._foreign(), *problems_of(bool(nodes), statuses, motion, table)),
                believed=self._table_belief(),
                attempted=self._attempt(),
            )

    def _on_table(self, msg: TableState) -> None:
        with self._lock:
            self._table = msg
            self._frames.append(time.monotonic())

    def _on_demonstration(self, msg: Demonstration) -> None:
        with self._lock:
            self._shown = msg, time.monotonic()

    def _on_joint_belief(self, msg: JointGoalBelief) -> None:
        with self._lock:
            self._believed = msg

    def _on_attempt(self, msg: Attempt) -> None:
        with self._lock:
            self._attempted = msg

    def _on_decision(self, msg: Decision) -> None:
        with self._lock:
            self._decisions[msg.id] = msg
            while len(self._decisions) > REMARKS_KEPT:
                del self._decisions[min(self._decisions)]
        self.ask_for_pending(self._on_pending)

    def _on_event(self, event: CellEvent, old: bool) -> None:
        data = event.data
        with self._lock:
            if event.kind == 'decision':
                self.history.decided('' if old else f'{datetime.now():%H:%M:%S}', data)
            elif event.kind == 'outcome':
                self.history.ended(data['decision'], data['result'])
            elif event.kind == 'answer':
                self.history.answered(data['request'], data['answer'], data['by'])
            elif event.kind == 'motion':
                begun = '' if data['ended'] else event.sentence
                self._moving = begun.replace(' begins.', '')
        if event.kind in ('outcome', 'answer', 'hold', 'resume') and not old:
            told = data['sentence'] if event.kind == 'outcome' else event.sentence
            prefix = {'hold': 'HELD ', 'resume': 'Motion allowed again '}.get(event.kind, '')
            self.remark(prefix + told)
            self.ask_for_pending(self._on_pending)

    def _on_pending(self, pending: list[HelpRequest]) -> None:
        with self._lock:
            self._pending = pending

    def _look(self) -> None:
        self.ask_for_pending(self._on_pending)
        others = tuple(self.other_operators())
        with self._lock:
            self._operators = others
        if self._world is None and self.names.message is not None:
            self._find_world()

    def _label(self) -> str:
        message = self.names.message
        return '' if message is None else label_of(message.name, message.digest)

    def _find_world(self) -> None:
        """Read the world's file: a shipped one by its name, or the one the nodes were given."""
        assert self.names.message is not None, 'It is looked for once its name is known.'
        if self._take_world(str(self.names.message.name)) or self._worlds is not None:
            return
        self._worlds = AsyncParameterClient(self, 'inference_node')
        if self._worlds.services_are_ready():
            future = self._worlds.get_parameters(['world'])
            future.add_done_callback(
                lambda done: self._take_world(done.result().values[0].string_value)
            )
        else:
            self._worlds = None

    def _take_world(self, place: str) -> bool:
        try:
            world = load_world(place)
        except ValueError:
            return False
        if world.label != self._label():
            return False
        self._world = world
        return True

    def _motion(self) -> MotionPermission:
        state: HoldState | None = self.hold_state
        if state is None or self.keeper_silence > HOLD_TIMEOUT:
            return MotionPermission(False, 'stopped: the hold keeper is not heard')
        if not state.held:
            return MotionPermission(True)
        by = f' by {state.by}' if state.by else ''
        return MotionPermission(False, f'held{by}')

    def _seen(self, now: float) -> SeenTable | None:
        if self._table is None or not self._mine(self._table):
            return None
        return seen_table(self._table, self.names, now - self._frames[-1])

    def _rate(self, now: float) -> float:
        """Table states per s, also while they stay away."""
        if len(self._frames) < 2:
            return 0.0
        return (len(self._frames) - 1) / max(now - self._frames[0], 1e-3)

    def _last_act(self, decision: MadeDecision | None, now: float) -> ShownAct | None:
        """What a decision is about; else the last demonstration."""
        record = None if decision is None else self.records.get(decision.id)
        if record is not None and record.get('demonstration'):
            return recorded_act(record['demonstration'], self._camera_time())
        if self._shown is None:
            return None
        message, heard = self._shown
        return shown_act(message, self.names, now - heard) if self._mine(message) else None

    def _table_belief(self) -> TableBelief | None:
        message = self._believed
        if message is None or not self._mine(message):
            return None
        return table_belief(message, self.names, self._age(message.header))

    def _attempt(self) -> ShownAttempt | None:
        message = self._attempted
        if message is None or not self._mine(message):
            return None
        return shown_attempt(message, self.names, self._age(message.header))

    def _age(self, header: Header) -> float:
        """By the camera's time, s: what a desk hears late, since it is latched, is old."""
        stamp = stamp_ns(header.stamp)
        return max(0.0, ((self._camera_time() or stamp) - stamp) / 1e9)

    def _mine(self, message: WorldMessage) -> bool:
        """Whether the numbers of a message are those of the cell's world."""
        return self.names.message is None or message.world in ('', self._label())

    def _foreign(self) -> list[str]:
        """Of which other worlds messages come, a sentence each."""
        shown = None if self._shown is None else self._shown[0]
        messages = (self._table, shown, self._attempted, self._believed)
        others = {m.world for m in messages if m is not None and not self._mine(m)}
        return [
            f'Messages of the world {other} are not shown, the cell is of {self._label()}.'
            for other in sorted(others)
        ]

    def _camera_time(self) -> int | None:
        """Stamp of the newest table state, ns."""
        return None if self._table is None else stamp_ns(self._table.header.stamp)

    def _decision(self, number: int | None) -> MadeDecision | None:
        if not self._decisions:
            return None
        number = max(self._decisions) if number is None else number
        message, record = self._decisions.get(number), self.records.get(number)
        if message is None:
            return None
        key = number, record is not None
        if key not in self._made:
            self._made[key] = made_decision(message, self.names, record)
        return self._made[key]

    def _question(self, request: HelpRequest) -> OpenQuestion:
        return open_question(request, self.names, self._age(request.header))

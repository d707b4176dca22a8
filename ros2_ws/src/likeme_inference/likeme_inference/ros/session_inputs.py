"""The inputs of the inference node's session, and the node's side of the replay protocol."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from functools import partial
from typing import Any

from rclpy.node import Node
from std_msgs.msg import Header

from likeme_core.ros.qos import OVERRIDABLE
from likeme_core.ros.time import stamp_ns, time_msg
from likeme_core.world import World
from likeme_inference.experience.store_error import StoreError
from likeme_inference.input_sequencer import InputSequencer
from likeme_inference.messages import motion_fields
from likeme_inference.ros.diagnostics import LOG_PERIOD, SessionDiagnostics
from likeme_inference.session_inputs import (
    CameraSilence,
    InputKind,
    InputValue,
    OperatorAnswer,
    SessionEvent,
    SessionInput,
    read_demonstration,
    read_heard,
    read_table,
)
from likeme_inference.tabletop.values import MotionReport, TableGoal
from likeme_inference.value_json import to_json, to_text
from likeme_msgs.msg import Demonstration, Heard, TableState

QUEUE_DEPTH = 100
#: Fields of Heard that an input without a topic of its own is acknowledged with.
HEARD_FIELDS = ('motion_outcome', 'finished', 'answer', 'object', 'goal', 'message')
#: Names of the topics' messages in diagnostics.
COUNTED = {InputKind.DEMONSTRATION: 'demonstrations', InputKind.TABLE_STATE: 'table states'}
#: Inputs that come once and are waited with while they cannot be logged. A table state is followed
#: by the next one, and an operator is told.
KEPT = (InputKind.DEMONSTRATION, InputKind.MOTION, InputKind.TABLE_GOAL)
#: A demonstration is made by hand: more than this many are not waited with.
KEPT_INPUTS = 100


class SessionInputs:
    """Receives the inputs of a session, applies them and acknowledges each one on `heard`.

    Live, an input is applied when it arrives. While replayed, messages wait until `hear_again`
    names them, and what arm and operator said comes from `hear_again` alone; see
    docs/replay_protocol.md.

    An input that cannot be logged changes nothing: see KEPT.

    Publishes heard (Heard, reliable 100). Subscribes demonstration (reliable 10), table_state
    (reliable 1), hear_again (Heard, reliable 100). All on behalf of its node.

    Attributes:
        replayed: whether all inputs come from a recording.
        receiving: whether messages are taken in; else they are dropped.
        count: inputs since the session began.
    """

    def __init__(
        self, node: Node, world: World, replayed: bool, health: SessionDiagnostics,
        apply: Callable[[InputValue], list[SessionEvent]],
        publish: Callable[[SessionEvent], None], last_view: Callable[[], int],
    ) -> None:  # fmt: skip
        """apply: applies an input to the session; ValueError: refused, StoreError: not logged.

        publish: takes each event. last_view: stamp of the session's newest table state, ns.
        """
        self._world, self._logger, self._health = world, node.get_logger(), health
        self._apply, self._publish, self._last_view = apply, publish, last_view
        self.receiving = False
        self.restart(replayed)
        self._heard_pub = node.create_publisher(Heard, 'heard', QUEUE_DEPTH)
        for kind, message, topic, depth in (
            (InputKind.DEMONSTRATION, Demonstration, 'demonstration', 10),
            (InputKind.TABLE_STATE, TableState, 'table_state', 1),
        ):
            node.create_subscription(
                message, topic, partial(self._on_message, kind), depth,
                qos_overriding_options=OVERRIDABLE,
            )  # fmt: skip
        node.create_subscription(Heard, 'hear_again', self._on_hear_again, QUEUE_DEPTH)

    def restart(self, replayed: bool) -> None:
        """Begin with a new session."""
        self.replayed, self.count = replayed, 0
        self._sequencer = InputSequencer()
        self._kept: deque[tuple[InputKind, Callable[[], InputValue], dict[str, Any]]] = deque(
            maxlen=KEPT_INPUTS
        )

    @property
    def kept(self) -> int:
        """Number of inputs that wait until they can be logged."""
        return len(self._kept)

    def poll(self) -> None:
        """Try again what could not be logged."""
        while self._kept:
            try:
                self._try(*self._kept[0])
            except StoreError:
                return
            self._kept.popleft()

    def motion(self, report: MotionReport) -> None:
        """Apply the arm's report."""
        self._take(InputKind.MOTION, lambda: report, **motion_fields(report))

    def answer(self, answer: OperatorAnswer) -> None:
        """Apply an operator's answer.

        Raises:
            StoreError: it cannot be logged.
        """
        fields = {
            'answer': int(answer.reply),
            'object': answer.object,
            'goal': '' if answer.goal is None else answer.goal.name,
            'message': answer.answered_by,
        }
        self._try(InputKind.ANSWER, lambda: answer, fields)

    def table_goal(self, goal: TableGoal) -> None:
        """Apply the joint goal of a person who has stopped."""
        self._take(InputKind.TABLE_GOAL, lambda: goal, message=to_text(to_json(goal)))

    def silence(self) -> None:
        """Apply that the camera shows nothing new."""
        self._take(InputKind.SILENCE, CameraSilence)

    def _on_message(self, kind: InputKind, msg: Any) -> None:
        if not self.receiving:
            self._health.counts[f'{COUNTED[kind]} while not active'] += 1
            return
        if not self.replayed:
            self._take_message(kind, msg)
            return
        self._sequencer.add_message(kind, stamp_ns(msg.header.stamp), msg)
        self._take_ready()

    def _on_hear_again(self, heard: Heard) -> None:
        if self.receiving and self.replayed and heard.kind in set(InputKind):
            stamp = stamp_ns(heard.header.stamp)
            self._sequencer.add_input(SessionInput(InputKind(heard.kind), stamp, heard))
            self._take_ready()

    def _take_ready(self) -> None:
        for kind, _, msg in self._sequencer.ready():
            if kind.has_topic:
                self._take_message(kind, msg)
            elif kind is InputKind.NOTHING:
                self._acknowledge(kind)
            else:
                fields = {name: getattr(msg, name) for name in HEARD_FIELDS}
                self._take(kind, partial(read_heard, kind, msg, self._world), **fields)

    def _take_message(self, kind: InputKind, msg: Any) -> None:
        read = read_table if kind is InputKind.TABLE_STATE else read_demonstration
        self._take(kind, partial(read, msg, self._world), header=msg.header)

    def _take(self, kind: InputKind, read: Callable[[], InputValue], **fields: Any) -> None:
        if self._kept and kind in KEPT:
            self._kept.append((kind, read, fields))
            return
        try:
            self._try(kind, read, fields)
        except StoreError as error:
            self._logger.error(
                f'{kind.name} waits or is dropped, as it cannot be logged: {error}',
                throttle_duration_sec=LOG_PERIOD,
            )
            if kind in KEPT:
                self._kept.append((kind, read, fields))

    def _try(
        self, kind: InputKind, read: Callable[[], InputValue], fields: dict[str, Any]
    ) -> None:
        events: list[SessionEvent] = []
        fields = dict(fields)
        try:
            events = self._apply(read())
        except ValueError as error:
            fields['refused'] = True
            if kind in COUNTED:
                self._health.drop(COUNTED[kind], error)
            else:
                self._logger.warning(f'{kind.name} does not fit the session: {error}')
        else:
            if kind in COUNTED:
                self._health.counts[COUNTED[kind]] += 1
        for event in events:
            self._publish(event)
        self._acknowledge(kind, **fields)

    def _acknowledge(self, kind: InputKind, **fields: Any) -> None:
        self.count += 1
        header = fields.pop('header', None) or Header(stamp=time_msg(self._last_view()))
        events = self._health.counts['events']
        self._heard_pub.publish(
            Heard(header=header, kind=int(kind), number=self.count, events=events, **fields)
        )

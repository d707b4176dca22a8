"""A stage behind the network: real nodes, every input acknowledged before the next one is sent."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Sequence
from typing import Any

from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from rclpy.qos import QoSProfile
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CameraInfo, Image

from likeme_bags.adapting import COLOUR, DEPTH, INFO
from likeme_bags.headers import header_stamp
from likeme_core.ros.time import stamp_ns, time_msg
from likeme_inference.input_sequencer import Cue, Input
from likeme_msgs import msg as messages
from likeme_msgs.msg import FrameDone, Heard
from likeme_replay.decision_log import TOPICS, Entry, Event, entry_of, in_order
from likeme_replay.input_scheduler import Done
from likeme_replay.playback_control import Transport
from likeme_replay.recorded_inputs import Frame
from likeme_replay.ros.input_messages import cue_message
from likeme_replay.ros.waiting_node import NotPlayedError, PatientNode

#: s after which a frame that nobody acknowledged is sent once more: a network may lose images.
RESEND = 1.0
#: s after which a node that acknowledges nothing is given up.
PATIENCE = 60.0
#: s in which nodes must be found: those that were started for this replay, on a busy machine.
DISCOVERY = 60.0
DEEP = QoSProfile(depth=1000)


class LockstepNode(PatientNode):
    """Shows frames to a running perception node and gives cues to a running inference node.

    Publishes: the three camera topics, as recorded; hear_again (Heard); /clock if wanted;
        table_state again where it went missing.
    Subscribes: frame_done, heard, table_state, demonstration, goal_belief, decision, outcome.
    Sets: `replayed` of inference_node to true while it plays, so that no arm moves, and every
        parameter of perception_node to what it is, which starts it anew.
    """

    def __init__(self, transport: Transport, clock: bool = False, **options: Any) -> None:
        super().__init__('replay', **options)
        self._transport = transport
        self._done: dict[int, FrameDone] = {}
        self._infos: set[int] = set()
        self._acts: dict[int, list[Entry]] = {}
        self._heard: deque[Heard] = deque()
        self._events: list[Entry] = []
        self._received = 0
        self._info = b''
        self._time = 0
        self.misfits = 0
        images = QoSProfile(depth=4)
        self._pubs = {
            INFO: self.create_publisher(CameraInfo, INFO, images),
            COLOUR: self.create_publisher(Image, COLOUR, images),
            DEPTH: self.create_publisher(Image, DEPTH, images),
        }
        self._clock = self.create_publisher(Clock, '/clock', 10) if clock else None
        # Perception and inference may find each other later than this node finds both of them: a
        # table state that inference missed is handed on.
        self._table = b''
        self._tables = self.create_publisher(messages.TableState, 'table_state', 1)
        self._cues = self.create_publisher(Heard, 'hear_again', 100)
        self.create_subscription(
            messages.TableState, 'table_state', self._on_table, DEEP, raw=True
        )
        # Acknowledgements last: who hears them was told of all the others before.
        for topic, (event, kind) in TOPICS.items():
            self._listen(topic, event, getattr(messages, kind.rpartition('/')[2]))
        self.create_subscription(FrameDone, 'frame_done', self._on_done, DEEP)
        self.create_subscription(Heard, 'heard', self._on_heard, DEEP)

    def _listen(self, topic: str, event: Event, kind: Any) -> None:
        names = list(kind.get_fields_and_field_types())

        def take(message: Any) -> None:
            entry = entry_of(event, message, names)
            if event is Event.DEMONSTRATION:
                self._acts.setdefault(entry.stamp, []).append(entry)
            else:
                self._events.append(entry)
                self._received += 1

        self.create_subscription(kind, topic, take, DEEP)

    def _on_table(self, data: bytes) -> None:
        self._table = data

    def _on_done(self, done: FrameDone) -> None:
        stamp = stamp_ns(done.header.stamp)
        if done.kind == FrameDone.CAMERA_INFO:
            self._infos.add(stamp)
        else:
            # Of a frame that was sent twice, what came of it first.
            self._done.setdefault(stamp, done)

    def _on_heard(self, heard: Heard) -> None:
        self._heard.append(heard)

    def begin(self) -> None:
        """Find the nodes, alone with them, and have them start anew.

        Raises:
            NotPlayedError: one is not there, or somebody else is a camera here.
        """
        for node in ('perception_node', 'inference_node'):
            client = AsyncParameterClient(self, node)
            self.until(
                client.services_are_ready,
                DISCOVERY,
                f'Expected {node} on this ROS domain, got none within {DISCOVERY:g} s: start it '
                'by start_cell.sh, or leave out --running.',
            )
            self._start_anew(client, node)
        self._check_alone()
        for topic, publisher in self._pubs.items():
            said = f'Expected perception to listen to {topic}, got nobody.'
            self.until(publisher.get_subscription_count, DISCOVERY, said)
        said = 'Expected inference to listen to hear_again, got nobody: is it an older one?'
        self.until(self._cues.get_subscription_count, DISCOVERY, said)
        self.until(self._answers, DISCOVERY, 'Expected inference to acknowledge, got nothing.')
        self._heard.clear()

    def _check_alone(self) -> None:
        """Others would make the outcome depend on the hour; discovery of them takes a while."""
        for topic in (COLOUR, DEPTH, INFO):
            others = self.count_publishers(topic) - 1
            if others > 0:
                raise NotPlayedError(
                    f'Expected nobody else to publish {topic}, got {others} others: stop the '
                    'camera, or replay on another ROS domain.'
                )

    def end(self) -> None:
        """Let the session be a live one again."""
        client = AsyncParameterClient(self, 'inference_node')
        if client.services_are_ready():
            future = client.set_parameters([Parameter('replayed', value=False)])
            self.until(future.done, 5.0, 'Expected inference_node to be let go, got no answer.')

    def show(self, frame: Frame) -> Done:
        """Send a frame when it is due and wait until perception is done with it."""
        self._transport.wait(frame.depth.stamp, self.spin)
        self._check_alone()
        self._tell_time(frame.stamp)
        self._show_info(frame)
        self._done.pop(frame.stamp, None)
        self._send(
            [(COLOUR, frame.colour.data), (DEPTH, frame.depth.data)],
            lambda: frame.stamp in self._done,
            f'the frame of stamp {frame.stamp} ns',
        )
        done = self._done.pop(frame.stamp)
        if done.kind == FrameDone.REFUSED:
            return Done(False, refused=done.reason)
        count = int(done.demonstrations)
        self.until(
            lambda: len(self._acts.get(frame.stamp, ())) >= count,
            PATIENCE,
            f'Expected {count} demonstrations of stamp {frame.stamp} ns, got fewer.',
        )
        return Done(bool(done.table_state), tuple(self._acts.pop(frame.stamp, ())))

    def hear(self, cue: Cue) -> list[Entry]:
        """Give a cue and wait until all it led to is here."""
        heard = self._given(cue_message(cue), cue.kind)
        self.misfits += heard.refused and not cue.kind.comes_by_topic
        self.until(
            lambda: self._received >= heard.events,
            PATIENCE,
            f'Expected {heard.events} beliefs, decisions and outcomes, got {self._received}.',
        )
        entries, self._events = self._events, []
        return in_order(entries)

    def _show_info(self, frame: Frame) -> None:
        """Publish the camera_info; wait for it when it says something new."""
        data, stamp = frame.info.data, header_stamp(frame.info.data)
        if data[12:] == self._info:
            self._pubs[INFO].publish(data)
            return
        self._infos.discard(stamp)
        self._send([(INFO, data)], lambda: stamp in self._infos, 'a camera_info')
        self._info = data[12:]

    def _send(
        self, parts: Sequence[tuple[str, bytes]], done: Callable[[], bool], what: str
    ) -> None:
        """Publish until it is acknowledged."""
        deadline = time.monotonic() + PATIENCE
        while not done():
            for topic, data in parts:
                self._pubs[topic].publish(data)
            if self.wait(done, RESEND):
                return
            if time.monotonic() > deadline:
                raise NotPlayedError(
                    f'Expected perception to acknowledge {what}, got nothing for {PATIENCE:g} s.'
                )

    def _given(self, message: Heard, kind: Input) -> Heard:
        """Give a cue; its acknowledgement."""
        self._cues.publish(message)
        said = f'Expected inference to acknowledge {kind.name}, got nothing for {PATIENCE:g} s.'
        while True:
            if not self.wait(lambda: bool(self._heard), RESEND) and kind is Input.TABLE_STATE:
                self._tables.publish(self._table)
            self.until(lambda: self._heard, PATIENCE, said)
            heard = self._heard.popleft()
            # A question whether anybody listens may be answered late.
            if heard.kind == kind:
                return heard

    def _answers(self) -> bool:
        self._cues.publish(cue_message(Cue(Input.NOTHING, 0, None)))
        return self.wait(lambda: bool(self._heard), 0.5)

    def _start_anew(self, client: AsyncParameterClient, node: str) -> None:
        if node == 'inference_node':
            values = [Parameter('replayed', value=True)]
        else:
            name = 'pairing_tolerance'
            got = self._result(client.get_parameters([name]), node)
            values = [Parameter(name, value=got.values[0].double_value)]
        for result in self._result(client.set_parameters(values), node).results:
            if not result.successful:
                raise NotPlayedError(f'{node} does not start anew: {result.reason}')

    def _result(self, future: Any, node: str) -> Any:
        self.until(future.done, DISCOVERY, f'Expected an answer of {node}, got none.')
        return future.result()

    def _tell_time(self, stamp: int) -> None:
        self._time = max(self._time, stamp)
        if self._clock is not None:
            self._clock.publish(Clock(clock=time_msg(self._time)))

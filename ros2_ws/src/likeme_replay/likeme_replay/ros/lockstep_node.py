"""Lockstep replay: every frame and input is acknowledged before the next one is sent."""

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
from std_srvs.srv import Trigger

from likeme_bags.camera_topics import COLOUR, DEPTH, INFO
from likeme_bags.headers import header_stamp
from likeme_core.ros.time import stamp_ns, time_msg
from likeme_inference.session_inputs import InputKind, SessionInput
from likeme_msgs import msg as messages
from likeme_msgs.msg import FrameDone, Heard
from likeme_replay.decision_log import TOPICS, LogEntry, LogEvent, entry_of_message, in_order
from likeme_replay.input_scheduler import FrameAck
from likeme_replay.playback_control import PlaybackControl
from likeme_replay.recorded_inputs import RecordedFrame
from likeme_replay.ros.input_messages import hear_again_message
from likeme_replay.ros.waiting_node import ReplayFailedError, WaitingNode

#: s after which a frame without acknowledgement is sent again: images may be lost.
RESEND_PERIOD = 1.0
#: s after which a node that acknowledges nothing is given up.
ACK_TIMEOUT = 60.0
#: s in which nodes must be found, also those that are still starting on a busy machine.
DISCOVERY_TIMEOUT = 60.0
#: s in which inference must leave its replayed session at the end.
RELEASE_TIMEOUT = 5.0
ALL_MESSAGES = QoSProfile(depth=1000)


class LockstepNode(WaitingNode):
    """A ReplayTarget of running perception and inference nodes; see docs/replay_protocol.md.

    Publishes: the three camera topics, as recorded; hear_again (Heard); /clock if wanted;
        table_state again where inference missed it.
    Subscribes: frame_done, heard, table_state, demonstration, goal_belief, decision, outcome.
    Calls: perception/reset.
    Sets: `replayed` of inference_node to true while it replays, so that no arm moves.
    """

    def __init__(self, control: PlaybackControl, clock: bool = False, **options: Any) -> None:
        super().__init__('replay', **options)
        self._control = control
        self._frames_done: dict[int, FrameDone] = {}
        self._infos_done: set[int] = set()
        self._acts: dict[int, list[LogEntry]] = {}
        self._heard: deque[Heard] = deque()
        self._events: list[LogEntry] = []
        self._events_received = 0
        self._info = b''
        self._time = 0
        self.refused_inputs = 0
        images = QoSProfile(depth=4)
        self._camera_pubs = {
            INFO: self.create_publisher(CameraInfo, INFO, images),
            COLOUR: self.create_publisher(Image, COLOUR, images),
            DEPTH: self.create_publisher(Image, DEPTH, images),
        }
        self._clock_pub = self.create_publisher(Clock, '/clock', 10) if clock else None
        # Perception and inference may discover each other later than this node discovers both: a
        # table state that inference missed is published again.
        self._table = b''
        self._table_pub = self.create_publisher(messages.TableState, 'table_state', 1)
        self._hear_again_pub = self.create_publisher(Heard, 'hear_again', 100)
        self.create_subscription(
            messages.TableState, 'table_state', self._on_table, ALL_MESSAGES, raw=True
        )
        # Acknowledgements last: once they are connected, the other topics are, too.
        for topic, (event, kind) in TOPICS.items():
            self._subscribe(topic, event, getattr(messages, kind.rpartition('/')[2]))
        self.create_subscription(FrameDone, 'frame_done', self._on_frame_done, ALL_MESSAGES)
        self.create_subscription(Heard, 'heard', self._on_heard, ALL_MESSAGES)

    def _subscribe(self, topic: str, event: LogEvent, kind: Any) -> None:
        names = list(kind.get_fields_and_field_types())

        def receive(message: Any) -> None:
            entry = entry_of_message(event, message, names)
            if event is LogEvent.DEMONSTRATION:
                self._acts.setdefault(entry.stamp, []).append(entry)
            else:
                self._events.append(entry)
                self._events_received += 1

        self.create_subscription(kind, topic, receive, ALL_MESSAGES)

    def _on_table(self, data: bytes) -> None:
        self._table = data

    def _on_frame_done(self, done: FrameDone) -> None:
        stamp = stamp_ns(done.header.stamp)
        if done.kind == FrameDone.CAMERA_INFO:
            self._infos_done.add(stamp)
        else:
            # Of a frame that was sent twice, the first acknowledgement counts.
            self._frames_done.setdefault(stamp, done)

    def _on_heard(self, heard: Heard) -> None:
        self._heard.append(heard)

    def begin(self) -> None:
        """Find and restart the nodes, and check that there is no other camera.

        Raises:
            ReplayFailedError: a node is missing, or there is another camera.
        """
        reset = self.create_client(Trigger, 'perception/reset')
        inference = AsyncParameterClient(self, 'inference_node')
        for node, is_ready in (
            ('perception_node', reset.service_is_ready),
            ('inference_node', inference.services_are_ready),
        ):
            self.require(
                is_ready, DISCOVERY_TIMEOUT,
                f'Expected {node} on this ROS domain, got none within {DISCOVERY_TIMEOUT:g} s: '
                'start it by start_cell.sh, or leave out --running.',
            )  # fmt: skip
        self._result(reset.call_async(Trigger.Request()), 'perception_node')
        parameters = [Parameter('replayed', value=True)]
        for result in self._result(inference.set_parameters(parameters), 'inference_node').results:
            if not result.successful:
                raise ReplayFailedError(f'inference_node does not restart: {result.reason}')
        self._check_only_camera()
        for topic, publisher in self._camera_pubs.items():
            sentence = f'Expected perception to subscribe to {topic}, got no subscription.'
            self.require(publisher.get_subscription_count, DISCOVERY_TIMEOUT, sentence)
        sentence = 'Expected inference to subscribe to hear_again, got no subscription.'
        self.require(self._hear_again_pub.get_subscription_count, DISCOVERY_TIMEOUT, sentence)
        sentence = 'Expected inference to acknowledge, got nothing.'
        self.require(self._inference_answers, DISCOVERY_TIMEOUT, sentence)
        self._heard.clear()

    def _check_only_camera(self) -> None:
        """Frames of another camera would change the log. Discovery of it may take a while."""
        for topic in (COLOUR, DEPTH, INFO):
            others = self.count_publishers(topic) - 1
            if others > 0:
                raise ReplayFailedError(
                    f'Expected nobody else to publish {topic}, got {others} others: stop the '
                    'camera, or replay on another ROS domain.'
                )

    def end(self) -> None:
        """Have inference begin a live session again."""
        client = AsyncParameterClient(self, 'inference_node')
        if client.services_are_ready():
            future = client.set_parameters([Parameter('replayed', value=False)])
            sentence = 'Expected inference_node to end its replayed session, got no answer.'
            self.require(future.done, RELEASE_TIMEOUT, sentence)

    def show_frame(self, frame: RecordedFrame) -> FrameAck:
        """Send a frame when it is due; returns when perception has processed it."""
        self._control.wait(frame.depth.stamp, self.spin)
        self._check_only_camera()
        self._publish_clock(frame.stamp)
        self._send_info(frame)
        self._frames_done.pop(frame.stamp, None)
        self._send(
            [(COLOUR, frame.colour.data), (DEPTH, frame.depth.data)],
            lambda: frame.stamp in self._frames_done,
            f'the frame of stamp {frame.stamp} ns',
        )
        done = self._frames_done.pop(frame.stamp)
        if done.kind == FrameDone.REFUSED:
            return FrameAck(table_state=False, rejection=done.reason)
        count = int(done.demonstrations)
        self.require(
            lambda: len(self._acts.get(frame.stamp, ())) >= count,
            ACK_TIMEOUT,
            f'Expected {count} demonstrations of stamp {frame.stamp} ns, got fewer.',
        )
        return FrameAck(bool(done.table_state), tuple(self._acts.pop(frame.stamp, ())))

    def apply_input(self, item: SessionInput) -> list[LogEntry]:
        """Have inference apply an input; returns when all its events are received."""
        heard = self._acknowledged(item)
        self.refused_inputs += heard.refused and not item.kind.has_topic
        self.require(
            lambda: self._events_received >= heard.events,
            ACK_TIMEOUT,
            f'Expected {heard.events} beliefs, decisions and outcomes, got '
            f'{self._events_received}.',
        )
        entries, self._events = self._events, []
        return in_order(entries)

    def _send_info(self, frame: RecordedFrame) -> None:
        """Publish the camera_info; wait for its acknowledgement if it differs from the last."""
        data, stamp = frame.info.data, header_stamp(frame.info.data)
        if data[12:] == self._info:
            self._camera_pubs[INFO].publish(data)
            return
        self._infos_done.discard(stamp)
        self._send([(INFO, data)], lambda: stamp in self._infos_done, 'a camera_info')
        self._info = data[12:]

    def _send(
        self, parts: Sequence[tuple[str, bytes]], done: Callable[[], bool], what: str
    ) -> None:
        """Publish repeatedly until acknowledged."""
        deadline = time.monotonic() + ACK_TIMEOUT
        while not done():
            for topic, data in parts:
                self._camera_pubs[topic].publish(data)
            if self.wait(done, RESEND_PERIOD):
                return
            if time.monotonic() > deadline:
                raise ReplayFailedError(
                    f'Expected perception to acknowledge {what}, got nothing in {ACK_TIMEOUT:g} s.'
                )

    def _acknowledged(self, item: SessionInput) -> Heard:
        """Send an input; its acknowledgement."""
        kind = item.kind
        self._hear_again_pub.publish(hear_again_message(item))
        sentence = f'Expected inference to acknowledge {kind.name}, got nothing.'
        while True:
            received = self.wait(lambda: bool(self._heard), RESEND_PERIOD)
            if not received and kind is InputKind.TABLE_STATE:
                self._table_pub.publish(self._table)
            self.require(lambda: self._heard, ACK_TIMEOUT, sentence)
            heard = self._heard.popleft()
            # An acknowledgement of NOTHING may come late.
            if heard.kind == kind:
                return heard

    def _inference_answers(self) -> bool:
        self._hear_again_pub.publish(hear_again_message(SessionInput(InputKind.NOTHING, 0)))
        return self.wait(lambda: bool(self._heard), 0.5)

    def _result(self, future: Any, node: str) -> Any:
        self.require(future.done, DISCOVERY_TIMEOUT, f'Expected an answer of {node}, got none.')
        return future.result()

    def _publish_clock(self, stamp: int) -> None:
        self._time = max(self._time, stamp)
        if self._clock_pub is not None:
            self._clock_pub.publish(Clock(clock=time_msg(self._time)))

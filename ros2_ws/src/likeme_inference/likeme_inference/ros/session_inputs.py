"""How the inference node hears: at once, or in a replay each thing at its cue."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.node import Node
from std_msgs.msg import Header

from likeme_core.ros.time import stamp_ns, time_msg
from likeme_inference.input_sequencer import Cue, Input, Rehearsal
from likeme_msgs.msg import Heard

DEPTH = 100


class Hearing:
    """Announces each thing a session takes in, and holds things back for a replay's cues.

    Publishes heard (Heard, reliable 100), subscribes hear_again (Heard, reliable 100), on behalf
    of its node.

    Attributes:
        inputs: things taken in since the session began.
    """

    def __init__(self, node: Node, replayed: bool, hear_again: Callable[[Input, Heard], None]):
        """hear_again: takes in what came by no topic in the recorded run; announces it itself."""
        self.inputs = 0
        self._rehearsal = Rehearsal(replayed)
        self._takes: dict[Input, Callable[[Any], None]] = {}
        self._hear_again = hear_again
        self._node = node
        self._heard_pub = node.create_publisher(Heard, 'heard', DEPTH)
        node.create_subscription(Heard, 'hear_again', self._on_cue, DEPTH)

    @property
    def replayed(self) -> bool:
        """Whether everything comes from a recording."""
        return self._rehearsal.on

    def begin(self, replayed: bool) -> None:
        """Hear for a new session."""
        self._rehearsal.begin(replayed)
        self.inputs = 0

    def subscribe(
        self, kind: Input, message: type, topic: str, take: Callable[[Any], None], depth: int
    ) -> None:
        """Have `take` called with what a topic brings, when it is its turn."""
        self._takes[kind] = take

        def stamp_of(msg: Any) -> int:
            return stamp_ns(msg.header.stamp)

        gate = self._rehearsal.gate(kind, stamp_of, take, self._play)
        self._node.create_subscription(message, topic, gate, depth)

    def announce(self, kind: Input, view: int, events: int, **fields: Any) -> None:
        """Say what was taken in.

        view: stamp of the newest table state then, ns, unless `header` is given. events: beliefs,
        decisions and outcomes so far.
        """
        self.inputs += 1
        header = fields.pop('header', None) or Header(stamp=time_msg(view))
        heard = Heard(header=header, kind=int(kind), number=self.inputs, events=events, **fields)
        self._heard_pub.publish(heard)

    def _on_cue(self, cue: Heard) -> None:
        if self.replayed and cue.kind in set(Input):
            stamp = stamp_ns(cue.header.stamp)
            self._rehearsal.add(Cue(Input(cue.kind), stamp, cue))
            self._play()

    def _play(self) -> None:
        """Take in what it is the turn of."""
        for cue, msg in self._rehearsal.ready():
            if cue.kind in self._takes:
                self._takes[cue.kind](msg)
            else:
                self._hear_again(cue.kind, cue.said)

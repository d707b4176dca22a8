"""An operator in simulated time: polls the questions, and answers what it has read."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from faults_parts.sim_graph import Future, Graph
from faults_parts.sim_node import SimNode
from faults_parts.sim_time import SIM_TIME
from likeme_core.world import World
from likeme_msgs.msg import HelpRequest
from likeme_msgs.srv import AskHuman

POLL_PERIOD = 0.25
#: s after which an answer of the service is not waited for any more.
PATIENCE = 1.0


@dataclass
class Manner:
    """How the operator answers.

    Attributes:
        reply: an AskHuman constant; DONE_BY_HAND where it is no option.
        away_until: steady time before which nothing is answered, s.
        copies: how often an answer is sent at once.
        rival: the reply of a second operator at the same moment; None: there is none.
        wrong: whether answers to something else are sent first.
    """

    reply: int = 1
    away_until: float = 0.0
    copies: int = 1
    rival: int | None = None
    wrong: bool = False


class Operator:
    """Answers each question once, until the answer was accepted.

    Attributes:
        manner: how it answers.
        asked: ids of the questions that were ever listed.
        clear_the_way: called before the robot is to try what was not free.
    """

    def __init__(
        self, graph: Graph, world: World, heard: Callable[[Any], None],
        accepted: Callable[[int, int], None],
    ) -> None:  # fmt: skip
        """heard: takes each list of questions; accepted: id and reply of an accepted answer."""
        self._world, self._heard, self._accepted = world, heard, accepted
        self.manner, self.asked = Manner(), set[int]()
        self.clear_the_way: Callable[[], None] = lambda: None
        self._waiting: tuple[float, Future] | None = None
        with graph.process('operator'):
            node = SimNode('operator')
            self._client = node.create_client(AskHuman, 'ask_human')
            node.create_timer(POLL_PERIOD, self._poll)

    def _poll(self) -> None:
        now = SIM_TIME.seconds
        if self._waiting is not None and now - self._waiting[0] < PATIENCE:
            return
        if self._client.service_is_ready():
            future = self._client.call_async(AskHuman.Request(command=AskHuman.Request.LIST))
            self._waiting = now, future
            future.add_done_callback(self._on_list)

    def _on_list(self, future: Future) -> None:
        if self._waiting is None or future is not self._waiting[1]:
            return
        self._waiting = None
        self._heard(future.result())
        for item in future.result().pending:
            self.asked.add(int(item.id))
            if SIM_TIME.seconds >= self.manner.away_until:
                self._answer(item)

    def _answer(self, item: Any) -> None:
        manner = self.manner
        # What cannot work is not among the options.
        reply = manner.reply if manner.reply in item.options else AskHuman.Request.DONE_BY_HAND
        if item.kind == HelpRequest.CLEAR_THE_WAY:
            self.clear_the_way()
        if manner.wrong:
            self._send(item, 'ann', reply, request_id=item.id + 1)
            self._send(item, 'ann', reply, object='nothing')
            self._send(item, 'ann', reply, answer=9)
            self._send(item, ' ', reply)
        for _ in range(manner.copies):
            self._send(item, 'ann', reply)
        if manner.rival is not None:
            self._send(item, 'bob', manner.rival)

    def _send(self, item: Any, who: str, reply: int, **wrong: Any) -> None:
        naming = reply == AskHuman.Request.NAME_GOAL
        if naming and item.id % 2:
            # A goal is not named for ever.
            naming, reply = False, AskHuman.Request.SKIP
        states = self._world.states
        fields = {
            'request_id': item.id, 'answer': reply, 'object': item.object,
            'action': self._world.actions[item.action].name, 'stamp': item.header.stamp,
            'goal': states[item.id // 2 % len(states)].name if naming else '',
        }  # fmt: skip
        request = AskHuman.Request(
            command=AskHuman.Request.ANSWER, answered_by=who, **fields | wrong
        )

        def on_response(future: Future) -> None:
            if future.result().success:
                self._accepted(int(request.request_id), int(request.answer))

        self._client.call_async(request).add_done_callback(on_response)

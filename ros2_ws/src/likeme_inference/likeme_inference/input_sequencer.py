"""Puts the inputs of a replayed session into their recorded order.

Messages of different topics arrive in no order relative to each other. A recorded run is a
sequence of inputs; while a session is replayed, a message waits here until its input is the next
one of the sequence.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from typing import Any

from likeme_inference.session_inputs import InputKind, SessionInput


class InputSequencer:
    """Holds messages back until their input is next."""

    def __init__(self) -> None:
        self._inputs: deque[SessionInput] = deque()
        self._messages: dict[tuple[InputKind, int], deque[Any]] = {}

    def add_input(self, item: SessionInput) -> None:
        """Append an input to the sequence."""
        self._inputs.append(item)

    def add_message(self, kind: InputKind, stamp: int, message: Any) -> None:
        """Keep a topic's message with its stamp, ns."""
        self._messages.setdefault((kind, stamp), deque()).append(message)

    def ready(self) -> Iterator[SessionInput]:
        """Remove and yield the inputs that can be applied now, each with its message."""
        while self._inputs:
            item = self._inputs[0]
            if not item.kind.has_topic:
                yield self._inputs.popleft()
                continue
            messages = self._messages.get((item.kind, item.stamp))
            if not messages:
                return
            message = messages.popleft()
            # Older messages of this kind are in no input that follows.
            self._messages = {
                key: kept
                for key, kept in self._messages.items()
                if kept and (key[0] is not item.kind or key[1] >= item.stamp)
            }
            yield self._inputs.popleft()._replace(message=message)

"""Policies of the inputs that the session acknowledges on `heard`."""

from __future__ import annotations

from typing import Any

from likeme_replay.policies.policy import Bounds, Expectant, Found, Policy
from likeme_replay.policies.seen import HEARD_DEMONSTRATION, HEARD_TABLE, Recent, Seen, stamp_of


class InputsCountUp(Policy):
    """The session numbers its inputs one by one; a smaller number is that of a new session.

    Its first numbers may be sent before anybody is connected to it.
    """

    def __init__(self, seen: Seen, bounds: Bounds) -> None:
        super().__init__(seen, bounds)
        self._last: int | None = None

    def on_heard(self, message: Any, _: float) -> Found:
        last, self._last = self._last, int(message.number)
        # One more 1 after a 1: that session was over with its first input.
        repeated = message.number == last != 1
        if last is not None and (repeated or message.number > last + 1):
            yield f'Expected input {last + 1}, got {message.number}.'


class EventsNeverFall(Policy):
    """The number of events that a session has come to never falls."""

    def __init__(self, seen: Seen, bounds: Bounds) -> None:
        super().__init__(seen, bounds)
        self._last: Any = None

    def on_heard(self, message: Any, _: float) -> Found:
        last, self._last = self._last, message
        if last is not None and message.number > last.number and message.events < last.events:
            yield f'Expected {last.events} events or more, got {message.events}.'


class RefusedInputsChangeNothing(Policy):
    """An input that was refused leads to no event."""

    def __init__(self, seen: Seen, bounds: Bounds) -> None:
        super().__init__(seen, bounds)
        self._last: Any = None

    def on_heard(self, message: Any, _: float) -> Found:
        last, self._last = self._last, message
        if last is None or not message.refused or message.number != last.number + 1:
            return
        if message.events != last.events:
            yield f'Expected {last.events} events after a refusal, got {message.events}.'


class InputsWerePublished(Expectant):
    """A table state or demonstration that the session took has been published."""

    def __init__(self, seen: Seen, bounds: Bounds) -> None:
        super().__init__(seen, bounds)
        # On a loaded machine a monitor may miss a table state, but hardly its acknowledgement
        # too, which comes after the session may have taken it.
        self._acknowledged: Recent[bool] = Recent(1000)
        self._run: Recent[str] = Recent(100)

    def on_heartbeat(self, message: Any, _: float) -> Found:
        if self._run.get(message.node, message.run) != message.run:
            # What a node sent just before it was killed may have reached the session alone.
            self._expected.clear()
        self._run[message.node] = message.run
        yield from ()

    def on_frame_done(self, message: Any, _: float) -> Found:
        if message.table_state:
            self._acknowledged[stamp_of(message)] = True
            self._expected.meet(stamp_of(message))
        yield from ()

    def on_heard(self, message: Any, now: float) -> Found:
        stamp, first = stamp_of(message), self.seen.first_stamp
        if message.refused or first is None or stamp < first:
            return
        published = stamp in self.seen.tables or stamp in self._acknowledged
        missed = self.seen.missed('table_state', now)
        if message.kind == HEARD_TABLE and not published and not missed:
            sentence = f'Expected a table state of {stamp} ns before it is taken, got none.'
            self._expected.expect(stamp, now + self.bounds.recovery, sentence)
        shown = {each for each, _ in self.seen.demonstrations}
        if message.kind == HEARD_DEMONSTRATION and stamp not in shown:
            yield f'Expected a demonstration of {stamp} ns before it is taken, got none.'


class DemonstrationsAreHeard(Expectant):
    """A session that takes in table states takes in every demonstration within a bound."""

    def __init__(self, seen: Seen, bounds: Bounds) -> None:
        super().__init__(seen, bounds)
        self._heard, self._number = float('-inf'), 0

    def on_demonstration(self, message: Any, now: float) -> Found:
        if now - self._heard <= self.bounds.told:
            sentence = f'Expected the session to take a demonstration of {message.object}.'
            self._expected.expect(stamp_of(message), now + self.bounds.taken, sentence)
        yield from ()

    def on_heard(self, message: Any, now: float) -> Found:
        number, self._number = self._number, int(message.number)
        if self._number <= number:
            # A new session: what came while there was none is lost.
            self._expected.clear()
        if message.kind == HEARD_DEMONSTRATION:
            self._expected.meet(stamp_of(message))
        self._heard = now
        yield from ()

    def tick(self, now: float) -> Found:
        for sentence in self._expected.overdue(now):
            if now - self._heard <= self.bounds.told:
                yield sentence

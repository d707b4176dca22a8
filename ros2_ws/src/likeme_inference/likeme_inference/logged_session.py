"""An imitation session whose every step is in the decision log before anything follows from it."""

from __future__ import annotations

from likeme_inference.experience.store_error import StoreError
from likeme_inference.help_requests import AcceptedAnswer
from likeme_inference.session_inputs import InputValue, SessionEvent, apply_input
from likeme_inference.session_log import SessionLog
from likeme_inference.tabletop.session import ImitationSession
from likeme_inference.tabletop.session_state import SessionState


class LoggedSession:
    """A session and its log.

    Attributes:
        session: the current one.
        log: where it is written.
        last_decision: id of the last decision that was logged, while a recording is replayed.
    """

    def __init__(self, session: ImitationSession, log: SessionLog) -> None:
        self.session, self.log = session, log
        self.last_decision = session.state.decisions

    def apply(self, value: InputValue, answer: AcceptedAnswer | None = None) -> list[SessionEvent]:
        """Apply an input; the events that it leads to, which are written.

        answer: that was accepted, if the input is one.

        Raises:
            ValueError: the input is refused.
            StoreError: it cannot be written; the session is as it was.
        """
        before = self.session.state.copy()
        events = apply_input(self.session, value)
        try:
            self.log.record(value, events, self.session, before, answer)
        except StoreError:
            self.session.state = before
            raise
        return events

    def restart(self, replayed: bool) -> None:
        """Begin a new session. A replayed one is not logged, and counts its decisions from 1."""
        if not self.log.paused:
            self.last_decision = self.session.state.decisions
        new = SessionState(decisions=self.last_decision)
        self.log.note_state(new)
        self.log.paused = replayed
        self.log.poll()
        state = SessionState() if replayed else new
        self.session = ImitationSession(self.session.model, self.session.settings, state)

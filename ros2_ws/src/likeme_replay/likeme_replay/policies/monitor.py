"""Checks all policies on a stream of messages."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Iterable, Iterator
from typing import Any

from likeme_replay.policies.catalogue import POLICIES
from likeme_replay.policies.policy import (
    QUESTIONS,
    TOPICS,
    Bounds,
    Found,
    Handler,
    Policy,
    Violation,
    method_of,
)
from likeme_replay.policies.seen import Seen

#: Violations that are kept; all are counted.
KEPT = 1000
#: s between two looks at what has not come in time.
TICK = 0.1


class PolicyMonitor:
    """Takes messages in the order in which they were published, and finds violations.

    Attributes:
        seen: what was received so far.
        violations: the latest.
        counts: number of violations by policy.
        messages: number of messages taken.
    """

    def __init__(
        self, bounds: Bounds | None = None, policies: Iterable[type[Policy]] = POLICIES
    ) -> None:
        self.seen = Seen()
        self.violations: deque[Violation] = deque(maxlen=KEPT)
        self.counts: Counter[str] = Counter()
        self.messages = 0
        checks = {each.name(): each(self.seen, bounds or Bounds()) for each in policies}
        self._ticked = float('-inf')
        self._waiting = [
            (name, policy)
            for name, policy in checks.items()
            if type(policy).tick is not Policy.tick
        ]
        self._handlers: dict[str, list[tuple[str, Handler]]] = {
            topic: [
                (name, getattr(policy, method_of(topic)))
                for name, policy in checks.items()
                if topic in policy.topics()
            ]
            for topic in (*TOPICS, QUESTIONS)
        }

    def hear(
        self, topic: str, message: Any, now: float, arrived: float | None = None
    ) -> list[Violation]:
        """Take a message of one of the topics; the violations it shows.

        Args:
            topic: one of policy.TOPICS.
            message: of this topic.
            now: when it was sent, s; of a recording, when it was recorded.
            arrived: when it was received here, s: others may have received it as late as this.
        """
        self.messages += 1
        found = self.tick(now) if abs(now - self._ticked) >= TICK else []
        for policy, handler in self._handlers[topic]:
            found += self._add(policy, handler(message, now), now)
        self.seen.update(topic, message, now, arrived)
        return found

    def miss(self, topic: str, since: float, until: float) -> None:
        """Messages of a topic between two times (s) were sent, and not received here.

        Policies that look back to such a topic do not judge what they cannot know.
        """
        self.seen.miss(topic, since, until)

    def remember(self, topic: str, message: Any, now: float) -> None:
        """Take a message from before the watch began, such as a latched one, unchecked."""
        self.seen.update(topic, message, now)

    def tick(self, now: float) -> list[Violation]:
        """Time has passed: the violations by what has not come until `now`, s."""
        found: list[Violation] = []
        self._ticked = now
        for name, policy in self._waiting:
            found += self._add(name, policy.tick(now), now)
        return found

    def _add(self, policy: str, sentences: Found, now: float) -> Iterator[Violation]:
        for sentence in sentences:
            violation = Violation(policy, now, sentence)
            self.counts[policy] += 1
            self.violations.append(violation)
            yield violation

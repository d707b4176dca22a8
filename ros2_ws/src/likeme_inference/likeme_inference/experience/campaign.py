"""A series of trials with one seed: which are to be made, and which come next after a restart."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from likeme_inference.experience.exploration_policy import ExplorationPolicy
from likeme_inference.experience.store import ExperienceStore
from likeme_inference.experience.trial import Counts, Pair, TrialKey, no_counts


@dataclass(frozen=True)
class Campaign:
    """What a learner is to do.

    Attributes:
        name: part of each trial's identity.
        seed: every trial's own seed and every choice follow from it.
    """

    robot: str
    name: str
    seed: int
    objects: tuple[str, ...]
    policy: ExplorationPolicy

    def key(self, pair: Pair, repetition: int) -> TrialKey:
        """The key of one of this campaign's trials."""
        return TrialKey(self.robot, self.name, pair, repetition)

    def choose(self, counts: Counts) -> TrialKey | None:
        """The trial after those counted; the same after the same counts, whatever came between."""
        made = sum(int(table.sum()) for table in counts.values())
        pair = self.policy.next(counts, np.random.default_rng([self.seed, made]))
        if pair is None:
            return None
        return self.key(pair, int(counts[pair.object][pair.x_i, pair.action].sum()))

    def plan(self) -> Iterator[TrialKey]:
        """Every trial of a policy that is not adaptive, from the first on."""
        counts = no_counts(self.objects)
        while (key := self.choose(counts)) is not None:
            yield key
            pair = key.pair
            # How it ends is no matter to such a policy.
            counts[pair.object][pair.x_i, pair.action, pair.x_i] += 1


class Progress:
    """A campaign and how far it has come in a store."""

    def __init__(self, campaign: Campaign, store: ExperienceStore) -> None:
        self.campaign, self._store = campaign, store
        policy = campaign.policy
        self._plan = None if policy.adaptive else tuple(campaign.plan())
        self._done = set(store.identities(campaign.robot, campaign.name))

    @property
    def total(self) -> int | None:
        """Trials in all; None where the policy decides on the way."""
        return None if self._plan is None else len(self._plan)

    @property
    def done(self) -> int:
        """How many of them are recorded."""
        if self._plan is None:
            return len(self._done)
        return sum(key.identity in self._done for key in self._plan)

    def missing(self) -> Iterator[TrialKey]:
        """The trials to make; an adaptive policy chooses each by what is recorded by then."""
        if self._plan is not None:
            yield from (key for key in self._plan if key.identity not in self._done)
            return
        while (key := self.campaign.choose(self._counts())) is not None:
            yield key

    def recorded(self, key: TrialKey) -> None:
        """Take note of a trial that is kept now."""
        self._done.add(key.identity)

    def _counts(self) -> Counts:
        campaign = self.campaign
        return self._store.counts(campaign.objects, [campaign.robot], [campaign.name])

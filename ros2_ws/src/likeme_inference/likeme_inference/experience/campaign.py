"""A series of trials with one seed, which can be resumed after a restart."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import count

import numpy as np
from numpy.typing import NDArray

from likeme_core.world import World
from likeme_inference.experience.exploration_policy import ExplorationPolicy
from likeme_inference.experience.store import ExperienceStore
from likeme_inference.experience.trial import Counts, Pair, TrialKey, no_counts


@dataclass(frozen=True)
class Campaign:
    """A series of trials.

    Attributes:
        world: of the states and actions.
        name: part of each trial's key.
        seed: of the seeds of all trials and of all choices.
    """

    world: World
    robot: str
    name: str
    seed: int
    objects: tuple[str, ...]
    policy: ExplorationPolicy

    def key(self, pair: Pair, repetition: int) -> TrialKey:
        """The key of a trial of this campaign."""
        return TrialKey(self.robot, self.name, pair, repetition)

    def choose(self, counts: Counts) -> TrialKey | None:
        """The next trial after those counted; depends on the seed and the counts alone."""
        made = sum(int(table.sum()) for table in counts.values())
        pair = self.policy.next(self.world, counts, np.random.default_rng([self.seed, made]))
        if pair is None:
            return None
        return self.key(pair, int(counts[pair.object][pair.x_i, pair.action].sum()))

    def plan(self) -> Iterator[TrialKey]:
        """All trials of a policy that is not adaptive, in order."""
        counts = no_counts(self.world, self.objects)
        while (key := self.choose(counts)) is not None:
            yield key
            pair = key.pair
            # Such a policy does not depend on the final state.
            counts[pair.object][pair.x_i, pair.action, pair.x_i] += 1


class Progress:
    """The recorded and the missing trials of a campaign."""

    def __init__(self, campaign: Campaign, store: ExperienceStore) -> None:
        self.campaign, self._store = campaign, store
        policy = campaign.policy
        self._plan = None if policy.adaptive else tuple(campaign.plan())
        self._done = set(store.identities(campaign.robot, campaign.name))

    @property
    def total(self) -> int | None:
        """Total number of trials; None for an adaptive policy."""
        return None if self._plan is None else len(self._plan)

    @property
    def done(self) -> int:
        """Number of recorded trials."""
        if self._plan is None:
            return len(self._done)
        return sum(key.identity in self._done for key in self._plan)

    def missing(self) -> Iterator[TrialKey]:
        """The trials to make; an adaptive policy chooses each from those recorded before it."""
        if self._plan is not None:
            yield from (key for key in self._plan if key.identity not in self._done)
            return
        while (key := self.campaign.choose(self._counts())) is not None:
            yield key

    def wanted(self) -> dict[str, NDArray[np.int64]]:
        """Object -> number of trials to make, shape [x_i, a]; of a policy that is not adaptive."""
        assert self._plan is not None, 'An adaptive policy has no plan.'
        world = self.campaign.world
        shape = len(world.states), len(world.actions)
        wanted = {name: np.zeros(shape, dtype=np.int64) for name in self.campaign.objects}
        for name, x_i, action in (key.pair for key in self.missing()):
            wanted[name][x_i, action] += 1
        return wanted

    def next_key(self, pair: Pair) -> TrialKey:
        """The key of the pair's next trial, in the plan or after it."""
        keys = (self.campaign.key(pair, repetition) for repetition in count())
        return next(key for key in keys if key.identity not in self._done)

    def recorded(self, key: TrialKey) -> None:
        """Mark a trial as recorded."""
        self._done.add(key.identity)

    def _counts(self) -> Counts:
        campaign = self.campaign
        return self._store.counts(campaign.objects, [campaign.robot], [campaign.name])

"""Whether a person has one of the goals at all: a test with a chosen rate of false alarms.

The statistic is the log ratio of the probabilities of all events of a demonstration, by a person
who acts at random and by one of rationality PURPOSEFUL or more with one of the goals
(`Watcher.log_evidence`). The threshold is the quantile of the statistic over simulated
demonstrations of the latter, so that the level is the share of them that is rejected. While a
demonstration lasts, `Watcher.p_value` is valid at every moment, and less powerful.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from likeme_inference.tabletop.arrays import drawn
from likeme_inference.tabletop.attempts import Attempt, Stopped
from likeme_inference.tabletop.joint_goals import JointGoals
from likeme_inference.tabletop.joint_watcher import PURPOSEFUL, Watcher

#: Acts after which a simulated demonstration ends.
LONGEST = 30


@dataclass(frozen=True)
class GoalTest:
    """The test of one hypothesis space.

    Attributes:
        level: share of demonstrations by people with a goal that are rejected.
        threshold: of `Watcher.log_evidence` after the person stopped, above which "none of these"
            holds.
    """

    level: float
    threshold: float

    @classmethod
    def of(
        cls,
        goals: JointGoals,
        rng: np.random.Generator,
        level: float = 0.05,
        demonstrations: int = 2000,
    ) -> GoalTest:
        """Find the threshold by simulation.

        Raises:
            ValueError: a level outside 0 to 1; no such kind of person.
        """
        if not 0 < level < 1:
            raise ValueError(f'Expected a level between 0 and 1, got {level:g}.')
        return cls.from_statistics(
            [simulated_statistic(goals, rng) for _ in range(demonstrations)], level
        )

    @classmethod
    def from_statistics(cls, found: Sequence[float], level: float = 0.05) -> GoalTest:
        """From values of `simulated_statistic`."""
        return cls(level, float(np.quantile(found, 1 - level)))

    def rejects(self, watcher: Watcher) -> bool:
        """Whether the person has none of the goals, as far as a finished demonstration tells."""
        return watcher.log_evidence > self.threshold


def simulated_statistic(goals: JointGoals, rng: np.random.Generator) -> float:
    """The statistic of a simulated demonstration of at least one act.

    Goal and person are drawn from their priors, the latter of rationality PURPOSEFUL or more, the
    start uniformly over the states within reach. The goal stays.

    Raises:
        ValueError: no such kind of person.
    """
    greatest = goals.people[:, 0].max()
    if greatest < PURPOSEFUL:
        raise ValueError(f'Expected a rationality of {PURPOSEFUL:g} or more, got {greatest:g}.')
    states, reach = goals.world.states, goals.world.out_of_reach
    reachable = [int(x) for x in states if x not in reach]
    kinds = goals.people_prior * (goals.people[:, 0] >= PURPOSEFUL)
    while True:
        where = rng.choice(reachable, len(goals.objects)).tolist()
        at = int(rng.choice(len(goals.goals), p=goals.prior)), drawn(kinds, rng)
        watcher = goals.watch(dict(zip(goals.objects, where, strict=True)))
        acts = 0
        while acts < LONGEST and (choice := drawn(goals.choices(where, *at), rng)):
            o, a = divmod(choice - 1, len(goals.world.actions))
            x_f = drawn(goals.outcome[o][a, where[o], :, at[1]], rng)
            watcher.see(Attempt(goals.objects[o], where[o], x_f, action=a))
            where[o], acts = x_f, acts + 1
        if acts:
            watcher.see(Stopped())
            return watcher.log_evidence

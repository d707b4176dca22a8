"""How often people set the table up in a campaign: planned, and when asked for each trial.

The world is a table of probabilities, from which trials are drawn. Objects do not touch: what they
do to each other on a real table is not in it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from likeme_core.tabletop import State
from likeme_core.world import World
from likeme_inference.experience.campaign import Campaign
from likeme_inference.experience.exploration_policy import Systematic
from likeme_inference.experience.reset_planning import ResetStep, TrialsWanted, next_step
from likeme_inference.experience.trial import Pair, no_counts
from likeme_inference.tabletop.arrays import FloatArray


class CampaignRun(NamedTuple):
    """What a campaign took.

    Attributes:
        trials: that were wanted, and made.
        motions: those in which the arm moved: x_i within reach.
        transports: trials beyond those wanted, to bring an object somewhere.
        resets: by people, of one object each.
        requests: to people, of one or more resets each.
        unavoidable: resets after wanted trials that ended out of reach, but for the last of an
            object: no order of the same trials with the same ends needs fewer.
    """

    trials: int
    motions: int
    transports: int
    resets: int
    requests: int
    unavoidable: int


class SimulatedTable:
    """Objects, each in a state; an action moves one by the world's probabilities.

    Attributes:
        seen: the state of each object.
        counts: trials so far, as in TrialsWanted.
        in_vain: pairs that left their object in the state it has, though aimed at another.
    """

    def __init__(
        self, world: World, truth: Mapping[str, FloatArray], rng: np.random.Generator
    ) -> None:
        """truth: object -> p(x_f | x_i, a), shape [x_i, a, x_f]. All start within reach."""
        self.world, self._truth, self._rng = world, truth, rng
        reachable = [state for state in world.states if state not in world.out_of_reach]
        self.seen: dict[str, State] = {
            name: reachable[int(rng.integers(len(reachable)))] for name in truth
        }
        self.counts = no_counts(world, tuple(truth))
        self.in_vain: set[Pair] = set()
        self._falls = dict.fromkeys(truth, 0)
        self._transports = 0

    def act(self, pair: Pair, wanted: bool) -> None:
        """Make a trial."""
        name, x_i, action = pair
        row = self._truth[name][x_i, action]
        x_f = self.world.states[int(self._rng.choice(len(row), p=row))]
        self.counts[name][x_i, action, x_f] += 1
        self.seen[name] = x_f
        self._transports += not wanted
        if x_f != x_i:
            self.in_vain = {pair for pair in self.in_vain if pair.object != name}
        elif x_i not in self.world.out_of_reach and action.target != x_i:
            self.in_vain.add(pair)
        out = self.world.out_of_reach
        self._falls[name] += wanted and x_i not in out and x_f in out

    def run(self, resets: int, requests: int) -> CampaignRun:
        """What the trials so far took."""
        per_state = sum(table.sum(axis=(1, 2)) for table in self.counts.values())
        motions = sum(
            int(n) for state, n in zip(self.world.states, per_state, strict=True)
            if state not in self.world.out_of_reach
        )  # fmt: skip
        unavoidable = sum(max(0, falls - 1) for falls in self._falls.values())
        wanted = int(sum(per_state)) - self._transports
        return CampaignRun(
            wanted, motions - self._transports, self._transports, resets, requests, unavoidable
        )


def planned_campaign(table: SimulatedTable, repetitions: int, seed: int) -> CampaignRun:
    """Every pair `repetitions` times, in the order of reset_planning."""
    missing: dict[str, NDArray[np.int64]] = {
        name: np.full(counts.shape[:2], repetitions) for name, counts in table.counts.items()
    }
    resets = requests = 0
    rng = np.random.default_rng([seed, 1])
    while True:
        wanted = TrialsWanted(
            missing, table.seen, table.counts, in_vain=frozenset(table.in_vain)
        )  # fmt: skip
        step = next_step(table.world, wanted, rng)
        if step is None:
            return table.run(resets, requests)
        if isinstance(step, ResetStep):
            requests += 1
            resets += len(step.resets)
            for name, state in step.resets:
                table.seen[name] = state
                table.in_vain = {pair for pair in table.in_vain if pair.object != name}
            continue
        table.act(step.pair, step.wanted)
        if step.wanted:
            missing[step.pair.object][step.pair.x_i, step.pair.action] -= 1


def asking_for_one_at_a_time(table: SimulatedTable, repetitions: int, seed: int) -> CampaignRun:
    """Any trial at hand, in random order, without a plan.

    A person is asked for each object as soon as nothing is wanted from its state.
    """
    missing = {name: np.full(c.shape[:2], repetitions) for name, c in table.counts.items()}
    resets, rng, states = 0, np.random.default_rng([seed, 2]), table.world.states
    while names := [name for name, wanted in missing.items() if wanted.any()]:
        name = names[int(rng.integers(len(names)))]
        wanted = missing[name]
        if not wanted[table.seen[name]].any():
            resets += 1
            there = np.flatnonzero(wanted.any(axis=-1))
            table.seen[name] = states[int(rng.choice(there))]
        x_i = table.seen[name]
        action = table.world.actions[int(rng.choice(np.flatnonzero(wanted[x_i])))]
        wanted[x_i, action] -= 1
        table.act(Pair(name, x_i, action), wanted=True)
    return table.run(resets, resets)


def asking_each_time(table: SimulatedTable, repetitions: int, seed: int) -> CampaignRun:
    """The same trials in the order of a campaign with simulated resets.

    A person is asked before each trial whose object is not in its x_i already.
    """
    names = tuple(table.counts)
    policy = Systematic(repetitions)
    campaign = Campaign(table.world, 'table', f'table-{seed}', seed, names, policy)
    resets = 0
    for key in campaign.plan():
        name, x_i, _ = key.pair
        if table.seen[name] != x_i:
            resets += 1
            table.seen[name] = x_i
        table.act(key.pair, wanted=True)
    return table.run(resets, resets)

"""Campaigns from command-line options."""

from __future__ import annotations

from collections.abc import Callable
from enum import StrEnum

from likeme_core.world import World
from likeme_inference.experience.campaign import Campaign
from likeme_inference.experience.exploration_policy import (
    ExplorationPolicy,
    InformationGain,
    Random,
    Systematic,
)


class PolicyName(StrEnum):
    """How the next pair is chosen."""

    SYSTEMATIC = 'systematic'
    RANDOM = 'random'
    INFORMATION_GAIN = 'information-gain'


class Resets(StrEnum):
    """Who sets the table up between trials."""

    SIMULATOR = 'simulator'
    HUMAN = 'human'


#: Trials of each pair, as in the paper.
REPETITIONS = 10
#: Name -> (number of pairs, repetitions, trials or None) -> policy.
POLICIES: dict[PolicyName, Callable[[int, int, int | None], ExplorationPolicy]] = {
    PolicyName.SYSTEMATIC: lambda _pairs, repetitions, _trials: Systematic(repetitions),
    PolicyName.RANDOM: lambda pairs, repetitions, trials: Random(
        pairs * repetitions if trials is None else trials
    ),
    # 2.5 trials a pair: 45 for each object of the paper's world.
    PolicyName.INFORMATION_GAIN: lambda pairs, _repetitions, trials: InformationGain(
        round(2.5 * pairs) if trials is None else trials
    ),
}


def campaign_of(
    world: World,
    kind: str,
    robot: str,
    seed: int,
    objects: tuple[str, ...],
    policy: PolicyName,
    repetitions: int | None,
    trials: int | None,
) -> Campaign:
    """A campaign.

    kind: 'offline', whose trials follow from the seed alone, 'live', or 'human': people set the
    table up, so that objects lie elsewhere within their states, and others are on the table. The
    name holds kind and seed, not the policy: a trial is the same however it was chosen.
    """
    pairs = len(objects) * len(world.states) * len(world.actions)
    chosen = POLICIES[policy](pairs, repetitions or REPETITIONS, trials)
    return Campaign(world, robot, f'{kind}-{seed}', seed, objects, chosen)

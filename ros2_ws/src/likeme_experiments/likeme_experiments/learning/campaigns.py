"""Campaigns from command-line options."""

from __future__ import annotations

from collections.abc import Callable
from enum import StrEnum

from likeme_core.tabletop import Action, State
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


#: Name -> (number of objects, repetitions, trials or None) -> policy.
POLICIES: dict[PolicyName, Callable[[int, int, int | None], ExplorationPolicy]] = {
    PolicyName.SYSTEMATIC: lambda _objects, repetitions, _trials: Systematic(repetitions),
    PolicyName.RANDOM: lambda objects, repetitions, trials: Random(
        objects * len(State) * len(Action) * repetitions if trials is None else trials
    ),
    PolicyName.INFORMATION_GAIN: lambda objects, _repetitions, trials: InformationGain(
        objects * 45 if trials is None else trials
    ),
}


def campaign_of(
    kind: str,
    robot: str,
    seed: int,
    objects: tuple[str, ...],
    policy: PolicyName,
    repetitions: int,
    trials: int | None,
) -> Campaign:
    """A campaign.

    kind: 'offline', whose trials follow from the seed alone, or 'live'. The name holds kind and
    seed, not the policy: a trial is the same however it was chosen.
    """
    chosen = POLICIES[policy](len(objects), repetitions, trials)
    return Campaign(robot, f'{kind}-{seed}', seed, objects, chosen)

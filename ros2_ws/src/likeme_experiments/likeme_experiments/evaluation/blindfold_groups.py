"""Looking scores of groups of agents that watch a blindfolded mentor (Fig 6)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import stats

from likeme_gaze.blindfold import (
    FIGURE_GROUPS,
    OLDER_GROUPS,
    THRESHOLDS,
    InfantGroup,
    infant,
    scores,
    turns,
)
from likeme_gaze.checks import FloatArray

GROUPS = (*FIGURE_GROUPS, *OLDER_GROUPS)


class GroupScore(NamedTuple):
    """Looking score of one group at one threshold.

    Attributes:
        mean: of the looking score, -4 to 4.
        standard_error: of that mean.
        agents: how many.
    """

    mean: float
    standard_error: float
    agents: int


def group_turns(seed: int, group: InfantGroup, agents: int, first: int = 0) -> FloatArray:
    """Every agent's turns towards the target, rad (agents, trials).

    Agent k depends on seed, group and k alone.
    """
    found = []
    for agent in range(first, first + agents):
        rng = np.random.default_rng([seed, GROUPS.index(group), agent])
        found.append(turns(rng, infant(rng, group.experience), group.covers))
    return np.array(found)


def group_score(turned: FloatArray, threshold: float = THRESHOLDS[0]) -> GroupScore:
    """Mean looking score of a group, turns in rad (agents, trials)."""
    each = scores(turned, threshold)
    error = float(each.std(ddof=1) / np.sqrt(len(each))) if len(each) > 1 else float('nan')
    return GroupScore(float(each.mean()), error, len(each))


def follows_more(one: FloatArray, other: FloatArray, threshold: float = THRESHOLDS[0]) -> float:
    """One-sided p-value of `one` having higher looking scores than `other` (Mann-Whitney)."""
    test = stats.mannwhitneyu(
        scores(one, threshold), scores(other, threshold), alternative='greater'
    )
    return float(test.pvalue)


def differs_from_zero(turned: FloatArray, threshold: float = THRESHOLDS[0]) -> float:
    """Two-sided p-value of a median looking score of 0 (Wilcoxon; 1 if all are 0)."""
    each = scores(turned, threshold)
    if not each.any():
        return 1.0
    return float(stats.wilcoxon(each, zero_method='pratt').pvalue)

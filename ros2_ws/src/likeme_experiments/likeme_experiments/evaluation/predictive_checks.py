"""Checks of a robot model against its own trials, and against trials that it has not seen."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from likeme_inference.tabletop.arrays import BoolArray, FloatArray, IntArray
from likeme_inference.tabletop.dirichlet import CONCENTRATION
from likeme_inference.tabletop.predictive_check import (
    REPLICATIONS,
    PredictiveCheck,
    exchangeable_check,
    halves,
    held_out_check,
    holm,
    posterior_check,
)
from likeme_inference.tabletop.prior import Prior
from likeme_inference.tabletop.robot_model import RobotModel

#: Random halves over which the p of trials without an order is taken.
SPLITS = 21


class ModelCheck(NamedTuple):
    """One check of all rows from states within reach.

    Attributes:
        name: short, unique.
        about: what predicts what.
        twice: whether the trials are predicted by themselves.
        overall: p of all rows together.
        p: of each row, shape [object, x_i, a]; NaN where not tested, as out of reach. Of `pooled`,
            shape [1, x_i, a].
    """

    name: str
    about: str
    twice: bool
    overall: float
    p: FloatArray

    @property
    def corrected(self) -> FloatArray:
        """Holm's p over the rows of this check, same shape."""
        return holm(self.p)


def predictive_checks(
    model: RobotModel,
    batches: IntArray | None,
    rng: np.random.Generator,
    splits: int = SPLITS,
    replications: int = REPLICATIONS,
) -> list[ModelCheck]:
    """All checks that the trials allow.

    Args:
        model: the robot's trials; each row has Dirichlet pseudo-counts CONCENTRATION.
        batches: the trials by source or in order, [batch, object, x_i, a, x_f]; None: only their
            totals are known.
        rng: of all replications.
        splits: number of random halves without batches.
        replications: of each check.
    """
    counts = np.array([known.counts for known in model.objects.values()])
    reach = np.broadcast_to(~model.domain.stuck[:, None], counts.shape[1:-1])
    parts = counts[None] if batches is None else batches
    found = [
        _check(
            'posterior', 'all trials, by the posterior after them', True,
            [posterior_check(parts, CONCENTRATION, rng, replications)], reach,
        )
    ]  # fmt: skip
    if batches is None:
        halved = [
            held_out_check(halves(counts, rng), CONCENTRATION, rng, replications)
            for _ in range(splits)
        ]
        about = f'half of the trials by the other half; {splits} random halves'
        found.append(_check('held out', about, False, halved, reach))
    else:
        later = held_out_check(batches, CONCENTRATION, rng, replications)
        about = 'each batch by those before it'
        found.append(_check('held out', about, False, [later], reach))
        dealt = exchangeable_check(batches, rng, replications)
        about = 'batches against the same trials in random order'
        found.append(_check('order', about, False, [dealt], reach))
    if len(model.objects) > 1:
        for prior in (Prior.SHARED, Prior.STRUCTURED):
            found.append(_by_the_others(model, counts, prior, reach, rng, replications))
        pooled = exchangeable_check(counts, rng, replications)
        about = 'one p(X_f | X_i, A) for all objects: objects dealt out anew'
        found.append(_check('pooled', about, False, [pooled], reach))
    return found


def _by_the_others(
    model: RobotModel,
    counts: IntArray,
    prior: Prior,
    reach: BoolArray,
    rng: np.random.Generator,
    replications: int,
) -> ModelCheck:
    """Each object by a prior that was fitted to the trials of the others."""
    p, overall = [], []
    for o, name in enumerate(model.objects):
        others = model.only([each for each in model.objects if each != name])
        alpha = others.counted(name, prior=prior).pseudo_counts
        check = held_out_check(counts[o][None], alpha, rng, replications, learned_from=0)
        p.append(np.where(reach, check.p(), np.nan))
        overall.append(check.overall(reach))
    # Each object predicts the others, so that their p depend on each other: Bonferroni.
    least = min(1.0, len(overall) * min(overall))
    about = f'each object by the others, prior {prior}'
    return ModelCheck(str(prior), about, False, least, np.array(p))


def _check(
    name: str, about: str, twice: bool, checks: Sequence[PredictiveCheck], reach: BoolArray
) -> ModelCheck:
    """One check, or one of several splits: twice the median of their p keeps any level."""
    factor = 1.0 if len(checks) == 1 else 2.0
    p = factor * np.median([check.p() for check in checks], axis=0)
    overall = factor * float(np.median([check.overall(reach) for check in checks]))
    p = np.where(reach, np.minimum(1.0, p), np.nan)
    return ModelCheck(name, about, twice, min(1.0, overall), p.reshape(-1, *reach.shape))

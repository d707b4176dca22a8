"""From trials to parameters: p(x_f | row, parameters) learned, then matched to the real counts.

A simulation-based fit: every trial, whatever its parameters, teaches logistic models with
quadratic terms; the parameters are then sought by differential evolution on that model.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import differential_evolution
from sklearn.compose import ColumnTransformer
from sklearn.linear_model import LogisticRegression
from sklearn.pipeline import Pipeline, make_pipeline
from sklearn.preprocessing import PolynomialFeatures, StandardScaler

from likeme_arm_sim.fitted import FITTED
from likeme_arm_sim.scene import State
from likeme_bringup.fitting.exact_test import deviance
from likeme_bringup.fitting.rows import Row
from likeme_bringup.fitting.trials import Draw, Values

Floats = NDArray[np.float64]
NAMES = tuple(FITTED)
PLACING = ('arm_bias_x', 'arm_noise', 'reach', 'grip_force', 'grasp_height', 'release_height',
           'place_share')  # fmt: skip
PUSHING = ('arm_bias_x', 'arm_noise', 'reach', 'push_gap', 'push_past', 'push_off_heading')
# Added to the probability of each end.
FLOOR = 0.005
# Regularisation of the logistic models (inverse strength).
STRENGTH = 0.1
# Trials whose parameters lie this far from the centre, in half ranges and per parameter, count
# e^-1/2.
KERNEL = 1.0
# How a row's G^2 becomes a share of a failed row: half at LIMIT, about the 5 % point.
LIMIT, SOFTNESS = 4.5, 1.0


def unit(values: Values) -> Floats:
    """Parameters in their searched ranges, -1 to 1."""
    return np.array(
        [2 * (values[n] - FITTED[n].low) / (FITTED[n].high - FITTED[n].low) - 1 for n in NAMES]
    )


def relevant(row: Row) -> list[int]:
    """Indices of the parameters that can matter to a row."""
    own = [n for n in NAMES if n.startswith(row.name)]
    return [NAMES.index(n) for n in (*own, *(PUSHING if row.action.is_push else PLACING))]


class Chance(NamedTuple):
    """Probability of an event as a logistic function of the parameters, quadratic in them.

    model: None where the event always or never happened; `rate` is its smoothed frequency.
    """

    model: Pipeline | None
    rate: float

    def at(self, features: Floats) -> Floats:
        """Of rows of features (N, F): (N,)."""
        if self.model is None:
            return np.full(len(features), self.rate)
        return np.asarray(self.model.predict_proba(features)[:, 1])


class RowModel(NamedTuple):
    """p(x_f | parameters) of one row: whether the object moves, and if so whether it arrives.

    A grasp does not know where the object will be carried, so that all place rows of an object
    teach the same chance of moving it; pushes across and off the table have one each.

    Attributes:
        row: whose model this is.
        moves, strays: moving at all; not arriving at the target, if it moves.
    """

    row: Row
    moves: Chance
    strays: Chance

    def probabilities(self, points: Floats) -> Floats:
        """Of LEFT, RIGHT, OFFTABLE at parameters (N, P) in unit ranges: (N, 3)."""
        features = _features(points, self.row)
        moves, strays = self.moves.at(features), self.strays.at(features)
        target, x_i = self.row.action.target, self.row.x_i
        p = np.full((len(points), 3), FLOOR)
        p[:, x_i] += 1 - moves
        p[:, target] += moves * (1 - strays)
        p[:, 3 - x_i - target] += moves * strays
        return np.asarray(p / p.sum(axis=1, keepdims=True))


def _features(points: Floats, row: Row) -> Floats:
    """The parameters that matter, (N, F); for pushes the side as well, which the hand hides."""
    chosen = points[:, relevant(row)]
    side = float(row.action.is_push) * (1.0 if row.x_i is State.LEFT else -1.0)
    return np.hstack([chosen, np.full((len(points), 1), side)])


def learn(row: Row, known: list[Row], draws: list[Draw], centre: Floats) -> RowModel:
    """The model of one row from trials of known rows like it, most from those near `centre`."""
    alike = [r for r in known if r.name == row.name and r.action.is_push is row.action.is_push]
    across = row.action.target is not State.OFFTABLE
    same = [r for r in alike if (r.action.target is not State.OFFTABLE) is across]
    moving = same if row.action.is_push else alike
    moves = _chance(moving, draws, centre, lambda r, end: end != r.x_i)
    moved = [(r, d) for r in same for d in draws if d.ends.get(str(r), r.x_i) != r.x_i]
    strays = _fitted(moved, centre, lambda r, end: end != r.action.target)
    return RowModel(row, moves, strays)


Event = Callable[[Row, int], bool]


def _chance(rows: list[Row], draws: list[Draw], centre: Floats, event: Event) -> Chance:
    return _fitted([(r, d) for r in rows for d in draws if str(r) in d.ends], centre, event)


def _fitted(trials: list[tuple[Row, Draw]], centre: Floats, event: Event) -> Chance:
    happened = np.array([event(row, draw.ends[str(row)]) for row, draw in trials], dtype=bool)
    rate = (happened.sum() + 0.5) / (len(trials) + 1.0)
    if len(set(happened.tolist())) < 2:
        return Chance(None, float(rate))
    points = [unit(draw.values) for _, draw in trials]
    features = np.concatenate(
        [_features(p[None], row) for p, (row, _) in zip(points, trials, strict=True)]
    )
    columns = relevant(trials[0][0])
    away = ((np.stack(points)[:, columns] - centre[columns]) / KERNEL) ** 2
    count = len(columns)
    terms = ColumnTransformer(
        [
            ('quadratic', PolynomialFeatures(2, include_bias=False), list(range(count))),
            ('side', 'passthrough', [count]),
        ]
    )
    model = make_pipeline(terms, StandardScaler(), LogisticRegression(C=STRENGTH, max_iter=2000))
    weights = np.exp(-0.5 * away.mean(axis=1))
    model.fit(features, happened, logisticregression__sample_weight=weights)
    return Chance(model, float(rate))


def best_values(
    rows: list[Row], draws: list[Draw], centre: Values, seed: int
) -> tuple[dict[str, float], float]:
    """Parameters whose modelled table fits best, and their loss.

    The models are learned from all draws, those near `centre` counting most.
    """
    start = unit(centre)
    models = [(row, learn(row, rows, draws, start)) for row in rows]
    bounds = [(-0.95, 0.95)] * len(start)

    def loss(points: Floats) -> Floats:
        return sum_of_losses(models, points.T)

    with warnings.catch_warnings():
        warnings.simplefilter('ignore')
        found = differential_evolution(
            loss, bounds, rng=seed, maxiter=150, popsize=12, vectorized=True,
            updating='deferred', polish=False, x0=np.clip(start, -0.95, 0.95),
        )  # fmt: skip
    values = {
        n: float(FITTED[n].low + (u + 1) / 2 * (FITTED[n].high - FITTED[n].low))
        for n, u in zip(NAMES, found.x, strict=True)
    }
    return values, float(found.fun)


def sum_of_losses(models: list[tuple[Row, RowModel]], points: Floats) -> Floats:
    """About how many rows would fail, plus a little of their deviance, at points (N, P)."""
    total = np.zeros(len(points))
    for row, model in models:
        g = np.array([deviance(row.real, p) for p in model.probabilities(points)])
        total += 1 / (1 + np.exp((LIMIT - g) / SOFTNESS)) + 0.02 * np.minimum(g, 30.0)
    return total

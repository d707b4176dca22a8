"""Expected gain of further trials for the robot's plans (paper: future work).

The robot acts on plans of several actions. A world is a transition model sampled from the
posterior of the trials. In a world the plan of the robot's mean model loses, against the best plan
of that world,

    loss = sum over k, x of w_k(x) (V*_k(x) - Q*_k(x, a)),   a: its best one, of equals the first,

with w_k(x) the probability of being in x with k actions left. Each term is divided between a and
the best action in proportion to the error of their qualities under the mean model. The mean over
worlds, divided by the number of trials of a pair plus one (the loss falls roughly with its
inverse), is the expected gain of one more trial. It is 0 for a pair whose outcome is random but
known, and for an unknown pair on which no decision depends.

Arrays carry leading axes (worlds, objects) before [x_i, a, x_f].
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from likeme_inference.tabletop.arrays import BoolArray, FloatArray, IntArray
from likeme_inference.tabletop.domain import TABLETOP
from likeme_inference.tabletop.finite_domain import Domain
from likeme_inference.tabletop.planning import NO_ACTION, best_actions, qualities, rank
from likeme_inference.tabletop.transition_model import maximum_likelihood

#: Action budget of the plans.
BUDGET = 3
#: Worlds sampled per object.
WORLDS = 64


def information_gain(
    pseudo_counts: FloatArray,
    rng: np.random.Generator,
    worlds: int = WORLDS,
    budget: int = BUDGET,
    domain: Domain = TABLETOP,
) -> FloatArray:
    """Approximate expected decrease of the plans' loss by one more trial of each pair.

    Args:
        pseudo_counts: trials and prior, above 0, shape [..., x_i, a, x_f].
        rng: samples the worlds.
        worlds: their number.
        budget: actions of the plans.
        domain: of the goals; all starts from which a goal is open have equal weight.

    Returns:
        Shape [..., x_i, a], summed over goals and starts; 0 where the robot cannot act.
    """
    _check_domain(pseudo_counts.shape, domain)
    expected = _qualities(maximum_likelihood(pseudo_counts), budget, domain)
    alpha = pseudo_counts[..., None, :, :, :]
    shape = (*pseudo_counts.shape[:-3], worlds, *pseudo_counts.shape[-3:])
    gamma = np.maximum(rng.standard_gamma(alpha, size=shape), np.finfo(np.float64).tiny)
    # Single precision halves the time; the sampling error is larger.
    world = (gamma / gamma.sum(axis=-1, keepdims=True)).astype(np.float32)
    actual = _qualities(world, budget, domain)
    resting = _resting(domain)
    where = np.broadcast_to(~resting, (*shape[:-3], *resting.shape)).astype(np.float32)
    credit = np.zeros(pseudo_counts.shape[:-1])
    for expected_k, actual_k in zip(reversed(expected), reversed(actual), strict=True):
        taken = np.broadcast_to(expected_k.argmax(axis=-1)[..., None, :, :], where.shape)
        credit += _credited(expected_k[..., None, :, :, :], actual_k, taken, where) / worlds
        where = np.einsum('...gx,...gxf->...gf', where, _rows(world, taken)) * ~resting
    return np.asarray(credit / (pseudo_counts.sum(axis=-1) + 1))


def _credited(
    expected: FloatArray, actual: FloatArray, taken: IntArray, where: NDArray[np.float32]
) -> FloatArray:
    """The loss with k actions left, divided between both actions; shape [..., x_i, a]."""
    actions, best = actual.shape[-1], actual.argmax(axis=-1)
    lost = where * (actual.max(axis=-1) - _at(actual, taken))
    off = np.abs(actual - expected) + 1e-9
    off_taken, off_best = _at(off, taken), _at(off, best)
    to_taken = 2 * lost * off_taken / (off_taken + off_best)
    shares = ((to_taken, taken), (2 * lost - to_taken, best))
    return np.asarray(
        sum(np.einsum('...wgx,...wgxa->...xa', s, _one_hot(a, actions)) for s, a in shares)
    )


def help_rate(
    model: FloatArray, world: FloatArray, budget: int = BUDGET, domain: Domain = TABLETOP
) -> FloatArray:
    """Probability that a goal is not reached by plans on `model` executed in `world`.

    The exact mean of 1 - P(reached) over objects (the last leading axis), goals and starts, with
    ties and unreachable goals as in `planning.plan`. Shape of the other leading axes; 0 if no goal
    is open from any start.
    """
    _check_domain(model.shape[1:], domain)
    reached, resting = domain.goal_matrix, _resting(domain)
    order = np.array([rank(model.shape[-2], aimed) for aimed in domain.aimed])[:, None]
    world = np.broadcast_to(world, np.broadcast_shapes(model.shape, world.shape))
    value = np.broadcast_to(reached, (*world.shape[:-3], *reached.shape))
    for quality in _qualities(model, budget, domain):
        taken = np.broadcast_to(best_actions(quality, order), value.shape)
        moved = (_rows(world, taken.clip(min=0)) * value[..., None, :]).sum(-1)
        value = np.where(resting | (taken == NO_ACTION), reached, moved)
    open_ = 1 - value[..., ~resting]
    return np.asarray(open_.mean(axis=(-1, -2)) if open_.size else open_.sum(axis=(-1, -2)))


def _check_domain(shape: tuple[int, ...], domain: Domain) -> None:
    if shape[-3:] != domain.shape:
        raise ValueError(f'Expected arrays [..., x_i, a, x_f] of {domain.shape}, got {shape}.')


def _qualities(transition: FloatArray, budget: int, domain: Domain) -> list[FloatArray]:
    return qualities(transition, domain.goal_matrix, _resting(domain), budget)


def _resting(domain: Domain) -> BoolArray:
    """Where the goal is reached or the object is out of reach, shape [g, x]."""
    return np.asarray(domain.goal_matrix.astype(bool) | domain.stuck)


def _one_hot(index: IntArray, size: int) -> FloatArray:
    return np.asarray(index[..., None] == np.arange(size), dtype=np.float64)


def _at(table: FloatArray, index: IntArray) -> FloatArray:
    return np.asarray(np.take_along_axis(table, index[..., None], axis=-1)[..., 0])


def _rows(transition: FloatArray, taken: IntArray) -> FloatArray:
    """The transition row of each taken action, shape [..., g, x, x_f]."""
    every = np.broadcast_to(transition[..., None, :, :, :], (*taken.shape, *transition.shape[-2:]))
    return np.asarray(np.take_along_axis(every, taken[..., None, None], axis=-2)[..., 0, :])

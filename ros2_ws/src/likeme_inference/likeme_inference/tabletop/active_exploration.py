"""Which trial the robot's decisions would gain most by (paper: future work).

The robot will act on plans of several actions. A transition model drawn from the posterior of its
trials is a world that may be the true one; there the plan it believes in loses, against the best
plan of that world,

    loss = sum over k, x of w_k(x) (V*_k(x) - Q*_k(x, a)),   a: its best one, of equals the first,

with w_k(x) how often it is in x with k actions left. Each term is credited to the two actions it
lies between, a and the best one, by how far the quality of each is from what was believed. The
mean over worlds, by the number of trials a pair has already (loss falls about as one by that
number), is what one more trial gains. A pair that is random but known loses nothing, nor does an
unknown one that no decision hangs on.

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

#: Actions of the plans that are learned for.
BUDGET = 3
#: Worlds drawn to judge one object's pairs by.
WORLDS = 64


def information_gain(
    pseudo_counts: FloatArray,
    rng: np.random.Generator,
    worlds: int = WORLDS,
    budget: int = BUDGET,
    domain: Domain = TABLETOP,
) -> FloatArray:
    """What one more trial of each pair gains: expected fall of the plans' loss, about.

    Args:
        pseudo_counts: trials and prior, above 0, shape [..., x_i, a, x_f].
        rng: draws the worlds.
        worlds: how many.
        budget: actions of the plans.
        domain: whose goals count; every start from which a goal is open counts alike.

    Returns:
        Shape [..., x_i, a]; sums over goals and starts. 0 where the robot cannot act.
    """
    _check_domain(pseudo_counts.shape, domain)
    believed = _qualities(maximum_likelihood(pseudo_counts), budget, domain)
    alpha = pseudo_counts[..., None, :, :, :]
    shape = (*pseudo_counts.shape[:-3], worlds, *pseudo_counts.shape[-3:])
    gamma = np.maximum(rng.standard_gamma(alpha, size=shape), np.finfo(np.float64).tiny)
    # Single precision halves the time; the worlds are drawn by chance anyway.
    world = (gamma / gamma.sum(axis=-1, keepdims=True)).astype(np.float32)
    truly = _qualities(world, budget, domain)
    resting = _resting(domain)
    where = np.broadcast_to(~resting, (*shape[:-3], *resting.shape)).astype(np.float32)
    credit = np.zeros(pseudo_counts.shape[:-1])
    for believed_k, truly_k in zip(reversed(believed), reversed(truly), strict=True):
        taken = np.broadcast_to(believed_k.argmax(axis=-1)[..., None, :, :], where.shape)
        credit += _credited(believed_k[..., None, :, :, :], truly_k, taken, where) / worlds
        where = np.einsum('...gx,...gxf->...gf', where, _rows(world, taken)) * ~resting
    return np.asarray(credit / (pseudo_counts.sum(axis=-1) + 1))


def _credited(
    believed: FloatArray, truly: FloatArray, taken: IntArray, where: NDArray[np.float32]
) -> FloatArray:
    """The loss with k actions left, shared by its two parties; summed, shape [..., x_i, a]."""
    actions, best = truly.shape[-1], truly.argmax(axis=-1)
    lost = where * (truly.max(axis=-1) - _at(truly, taken))
    off = np.abs(truly - believed) + 1e-9
    off_taken, off_best = _at(off, taken), _at(off, best)
    to_taken = 2 * lost * off_taken / (off_taken + off_best)
    shares = ((to_taken, taken), (2 * lost - to_taken, best))
    return np.asarray(
        sum(np.einsum('...wgx,...wgxa->...xa', s, _one_hot(a, actions)) for s, a in shares)
    )


def help_rate(
    model: FloatArray, world: FloatArray, budget: int = BUDGET, domain: Domain = TABLETOP
) -> FloatArray:
    """How often a goal is still open after plans on the model were followed in the world.

    The mean over objects (the last leading axis), goals and starts of 1 - P(reached), exact;
    as `planning.plan` and `spread` have it for one: no action where none can help, and ties go to
    the actions meant for the goal. Shape of the other leading axes; 0 where no start is open.
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
    """Where nothing is left to do or nothing can be done, shape [g, x]."""
    return np.asarray(domain.goal_matrix.astype(bool) | domain.stuck)


def _one_hot(index: IntArray, size: int) -> FloatArray:
    return np.asarray(index[..., None] == np.arange(size), dtype=np.float64)


def _at(table: FloatArray, index: IntArray) -> FloatArray:
    return np.asarray(np.take_along_axis(table, index[..., None], axis=-1)[..., 0])


def _rows(transition: FloatArray, taken: IntArray) -> FloatArray:
    """The row of each taken action, shape [..., g, x, x_f]."""
    every = np.broadcast_to(transition[..., None, :, :, :], (*taken.shape, *transition.shape[-2:]))
    return np.asarray(np.take_along_axis(every, taken[..., None, None], axis=-2)[..., 0, :])

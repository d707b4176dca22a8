"""Fit of the structure of `structured_prior`: variances of the components, and the mirror.

The variances maximise Laplace's evidence of all trials times a log-normal prior (standard
deviation SPREAD) around SHARED and OWN. Of the mirrors of the domain the one of greatest evidence
at SHARED and OWN is kept, if it explains the trials better than none.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from likeme_inference.tabletop.arrays import FloatArray
from likeme_inference.tabletop.finite_domain import Domain
from likeme_inference.tabletop.laplace import laplace
from likeme_inference.tabletop.latent_kernel import Mirror, RowKernel, mirrors, row_kernel

#: Standard deviations in log odds, in the order of latent_kernel.COMPONENTS. They maximise the
#: evidence of the two other shipped worlds, of simulated robots, in which no mirror is found.
SHARED = (0.25, 0.25, 1.0, 0.3, 0.3)
OWN = (0.7, 0.15, 0.8, 0.3, 0.12)
#: Of the logarithm of each standard deviation.
SPREAD = 0.7
#: Greatest deviation from SHARED and OWN, log.
FARTHEST = 2.5
#: Iterations of the search.
ITERATIONS = 30
#: Added to the diagonal of the kernel.
JITTER = 1e-6


class Structure(NamedTuple):
    """Standard deviations of the components, log odds, and the mirror.

    Attributes:
        shared: in common to all objects, shape [component].
        own: of single objects, shape [component].
        mirror: image of each state, shape [x]; None: no symmetry.
    """

    shared: tuple[float, ...] = SHARED
    own: tuple[float, ...] = OWN
    mirror: Mirror | None = None


def kernel_over(rows: RowKernel, structure: Structure, similarity: FloatArray) -> FloatArray:
    """K over [object, row], square.

    similarity: S, shape [object, object].
    """
    shared, own = (
        np.tensordot(np.square(deviations), rows.components, axes=1)
        for deviations in (structure.shared, structure.own)
    )
    kernel = np.kron(np.ones_like(similarity), shared) + np.kron(similarity, own)
    kernel[np.diag_indices_from(kernel)] += JITTER
    return np.asarray(kernel)


def fit_structure(counts: FloatArray, domain: Domain) -> Structure:
    """The structure that explains the trials of all objects best.

    counts: shape [object, x_i, a, x_f]; objects without trials are left out.

    Raises:
        ValueError: an action is aimed at no single state.
    """
    tried = counts[counts.sum(axis=(1, 2, 3)) > 0]
    none = Structure()
    if not len(tried):
        return none
    candidates = [none, *(none._replace(mirror=mirror) for mirror in mirrors(domain))]
    best = max(
        candidates,
        key=lambda structure: _evidence(tried, row_kernel(domain, structure.mirror), structure),
    )
    # Here, as few who import this module fit one.
    from scipy.optimize import minimize

    rows = row_kernel(domain, best.mirror)
    start = np.array([*SHARED, *OWN])
    open_ = np.tile(rows.components.any(axis=(1, 2)), 2)

    def at(logs: FloatArray) -> Structure:
        deviations = np.zeros_like(start)
        deviations[open_] = start[open_] * np.exp(logs)
        shared, own = np.split(deviations, 2)
        return Structure(tuple(shared.tolist()), tuple(own.tolist()), best.mirror)

    def loss(logs: FloatArray) -> float:
        return float((logs @ logs) / (2 * SPREAD**2) - _evidence(tried, rows, at(logs)))

    bounds = [(-FARTHEST, FARTHEST)] * int(open_.sum())
    found = minimize(
        loss, np.zeros(len(bounds)), method='L-BFGS-B', bounds=bounds,
        options={'maxiter': ITERATIONS},
    )  # fmt: skip
    return at(found.x)


def _evidence(counts: FloatArray, rows: RowKernel, structure: Structure) -> float:
    reached, trials = rows.succeeded(rows.trials(counts))
    kernel = kernel_over(rows, structure, np.eye(len(counts)))
    return laplace(kernel, reached.ravel(), trials.ravel()).evidence

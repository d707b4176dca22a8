"""Priors of the objects of one robot, fitted to their trials at first use."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property

import numpy as np

from likeme_inference.tabletop.arrays import FloatArray
from likeme_inference.tabletop.finite_domain import Domain
from likeme_inference.tabletop.prior import Prior
from likeme_inference.tabletop.shared_prior import PriorWeights, fit_weights, shared_prior
from likeme_inference.tabletop.structure_fit import Structure, fit_structure
from likeme_inference.tabletop.structured_prior import StructuredPrior
from likeme_inference.tabletop.transition_model import TransitionModel

#: What an object borrows: names of other objects, and how many trials they are worth to it.
Borrowed = tuple[tuple[str, float], ...]


class ObjectPriors:
    """The shared and the structured prior of each object, and of one without trials.

    objects: name -> trials. The name None stands for an object without trials.
    """

    def __init__(self, objects: Mapping[str, TransitionModel], domain: Domain) -> None:
        self._names: tuple[str | None, ...] = (*objects, None)
        self._domain = domain
        tried = [known.counts for known in objects.values()]
        self._counts = np.array([*tried, np.zeros(domain.shape)], dtype=np.float64)

    def pseudo_counts(self, prior: Prior, name: str | None) -> FloatArray:
        """Dirichlet pseudo-counts of an object by Prior.SHARED or STRUCTURED, [x_i, a, x_f].

        Raises:
            ValueError: an action is aimed at no single state.
        """
        found = self._shared if prior is Prior.SHARED else self._structured(name).pseudo_counts
        return np.asarray(found[self._names.index(name)])

    def borrowed(self, prior: Prior, name: str | None, x_i: int, a: int) -> Borrowed:
        """From which objects a row borrows how many trials, the greatest first.

        By Prior.SHARED a share of the trials of the same pair; by STRUCTURED see there, the row's
        object itself, with its other rows, among them.
        """
        o = self._names.index(name)
        if prior is Prior.SHARED:
            trials = self._counts[:, x_i, a].sum(axis=-1) * float(self._weights.share)
            trials[o] = 0.0
        else:
            trials = self._structured(name).borrowed(o, x_i, a)
        each = zip(self._names, trials.tolist(), strict=False)
        lent = [(lender, worth) for lender, worth in each if lender is not None and worth > 0]
        return tuple(sorted(lent, key=lambda item: -item[1]))

    @cached_property
    def _weights(self) -> PriorWeights:
        return fit_weights(self._counts[:-1], self._domain.state_aims, rounds=3)

    @cached_property
    def _shared(self) -> FloatArray:
        return shared_prior(self._counts, self._weights, self._domain.state_aims)

    @cached_property
    def _structure(self) -> Structure:
        return fit_structure(self._counts, self._domain)

    def _structured(self, name: str | None) -> StructuredPrior:
        return self._with_untried if name is None else self._of_the_tried

    @cached_property
    def _of_the_tried(self) -> StructuredPrior:
        return StructuredPrior(self._counts[:-1], self._domain, self._structure)

    @cached_property
    def _with_untried(self) -> StructuredPrior:
        return StructuredPrior(self._counts, self._domain, self._structure)

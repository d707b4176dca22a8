"""Trial counts of a robot with their sources, and the models learned from them per object."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from likeme_inference.tabletop.bounded_cache import BoundedCache
from likeme_inference.tabletop.checks import number
from likeme_inference.tabletop.domain import TABLETOP, Policy
from likeme_inference.tabletop.finite_domain import Domain
from likeme_inference.tabletop.goal_model import Estimated, GoalModel
from likeme_inference.tabletop.object_priors import Borrowed, ObjectPriors
from likeme_inference.tabletop.prior import Prior
from likeme_inference.tabletop.transition_model import TransitionModel

#: Goal models that are kept for the next call. A decision needs one per object; others belong to
#: settings that were changed since, of which a node that runs for long may see any number.
GOAL_MODELS_KEPT = 64


class TrialCounts(NamedTuple):
    """Outcome counts of one action from one state, from one source.

    Attributes:
        counts: trials per final state, shape [x_f].
        source: key of RobotModel.sources.
    """

    object: str
    x_i: int
    action: int
    counts: tuple[int, ...]
    source: str


@dataclass(frozen=True)
class RobotModel:
    """Named, versioned trial counts and the models that follow from them.

    Attributes:
        sources: key -> description of where the trials were made.
        rows: at most one per object, x_i, action and source; counts of sources are added.
        domain: of the rows' states and actions.
        left_out: objects whose rows `only` left out.
    """

    name: str
    version: str
    sources: Mapping[str, str]
    rows: tuple[TrialCounts, ...]
    domain: Domain = TABLETOP
    left_out: tuple[str, ...] = ()
    _goal_models: BoundedCache[GoalModel] = field(
        default_factory=lambda: BoundedCache(GOAL_MODELS_KEPT),
        init=False,
        repr=False,
        compare=False,
    )

    def __post_init__(self) -> None:
        object.__setattr__(self, 'rows', tuple(self.rows))
        for row in self.rows:
            self._check(row)
        keys = Counter((row.object, row.x_i, row.action, row.source) for row in self.rows)
        twice = next((key for key, n in keys.items() if n > 1), None)
        if twice is not None:
            raise ValueError(f'Expected each row once, got {keys[twice]} of {twice}.')
        nowhere = next((row for row in self.rows if row.source not in self.sources), None)
        if nowhere is not None:
            raise ValueError(
                f'Expected one of the sources {sorted(self.sources)}, got {nowhere.source!r}.'
            )
        object.__setattr__(self, 'sources', MappingProxyType(dict(self.sources)))

    def _check(self, row: TrialCounts) -> None:
        states, actions, _ = self.domain.shape
        number('x_i', row.x_i, states)
        number('action', row.action, actions)
        whole = all(isinstance(n, (int, np.integer)) and n >= 0 for n in row.counts)
        if len(row.counts) != states or not whole:
            raise ValueError(f'Expected {states} whole counts of 0 or more, got {row.counts}.')

    def __reduce__(self) -> tuple[type[RobotModel], tuple[object, ...]]:
        """Pickle by the arguments, as mapping proxies cannot be pickled."""
        fields = self.name, self.version, dict(self.sources), self.rows, self.domain, self.left_out
        return RobotModel, fields

    @property
    def label(self) -> str:
        """Name and version, as used in messages and figures."""
        return f'{self.name} {self.version}'

    def only(self, names: Collection[str]) -> RobotModel:
        """The same model with the rows of these objects alone."""
        left_out = tuple(name for name in self.objects if name not in names)
        if not left_out:
            return self
        rows = tuple(row for row in self.rows if row.object in names)
        return RobotModel(self.name, self.version, self.sources, rows, self.domain, left_out)

    @cached_property
    def objects(self) -> Mapping[str, TransitionModel]:
        """Object name -> transition model, in the order of the rows."""
        totals: dict[str, np.ndarray[tuple[int, ...], np.dtype[np.int64]]] = {}
        for row in self.rows:
            zero = np.zeros(self.domain.shape, dtype=np.int64)
            totals.setdefault(row.object, zero)[row.x_i, row.action] += row.counts
        return MappingProxyType({name: TransitionModel(counts) for name, counts in totals.items()})

    def model_of(self, name: str) -> TransitionModel:
        """The transition model of one object.

        Raises:
            ValueError: an object without trials.
        """
        if name not in self.objects:
            raise ValueError(f'Expected one of the objects {list(self.objects)}, got {name!r}.')
        return self.objects[name]

    def counted(
        self, name: str, concentration: float = 0.0, prior: Prior = Prior.OWN
    ) -> TransitionModel:
        """The transition model of one object with a prior; of an untried one, the prior's mean.

        Args:
            name: of the object.
            concentration: Dirichlet pseudo-count of every final state with Prior.OWN; 0: maximum
                likelihood.
            prior: OWN, or one fitted to the trials of all objects.

        Raises:
            ValueError: an object without trials and no prior; a fitted prior of actions that aim
                at no state.
        """
        fitted = Prior(prior) is not Prior.OWN
        untried = name not in self.objects and (fitted or concentration > 0)
        counts = np.zeros(self.domain.shape, int) if untried else self.model_of(name).counts
        if fitted:
            known = None if untried else name
            return TransitionModel(counts, self._priors.pseudo_counts(prior, known))
        return TransitionModel(counts, concentration)

    def borrowed(self, name: str, x_i: int, a: int, prior: Prior) -> Borrowed:
        """How many trials of which objects the prior of a pair is worth; none with Prior.OWN.

        Raises:
            ValueError: actions that aim at no state.
        """
        if Prior(prior) is Prior.OWN:
            return ()
        known = name if name in self.objects else None
        return self._priors.borrowed(prior, known, x_i, a)

    @cached_property
    def _priors(self) -> ObjectPriors:
        return ObjectPriors(self.objects, self.domain)

    def goal_model(
        self,
        name: str,
        goal_prior: Sequence[float] | None = None,
        policy: Policy = Policy.DIRECT,
        concentration: float = 0.0,
        prior: Prior = Prior.OWN,
    ) -> GoalModel:
        """The goal model of one object; the latest GOAL_MODELS_KEPT are cached.

        Args:
            name: of the object.
            goal_prior: P(G), shape [g]; None: uniform.
            policy: which of the paper's two variants.
            concentration: see `counted`.
            prior: see `counted`.

        Raises:
            ValueError: see `counted`; an unknown policy or an invalid prior.
        """
        policy = Policy(policy)
        goal_prior = None if goal_prior is None else tuple(goal_prior)
        key = name, goal_prior, policy, concentration, Prior(prior)
        return self._goal_models.get(
            key,
            lambda: GoalModel.of(
                self.counted(name, concentration, prior), self.domain, goal_prior, policy=policy
            ),
        )

    def promising_model(
        self,
        name: str,
        goal_prior: Sequence[float] | None = None,
        policy: Policy = Policy.DIRECT,
        concentration: float = 0.0,
        prior: Prior = Prior.OWN,
    ) -> GoalModel:
        """The same goal model, never certain: success that is promised is a mean over draws.

        Relative frequencies say nothing of how far they are off, and the best of several promises
        too much. They still choose; what is promised of the choice is by Prior.SHARED.

        Args and errors: see `goal_model`.
        """
        known = self.goal_model(name, goal_prior, policy, concentration, prior)
        if known.estimated is not None or not self.domain.aimed_at_states:
            return known
        key = known, Prior.SHARED
        return self._goal_models.get(
            key,
            lambda: replace(
                known,
                estimated=Estimated(
                    self.counted(name, prior=Prior.SHARED).pseudo_counts, Policy(policy)
                ),
            ),
        )

"""Kernel over actions for `structured_prior`: of which actions success is alike.

A row is a pair (x_i, a) that is to move the object: x_i within reach and not the target of a. Two
rows have a component in common if they have the same label in it:

| component | label |
| --- | --- |
| `all` | none: it is common to all rows |
| `direction` | whether the target is within reach |
| `manner` | whether the target is within reach, manner of the action |
| `mirror` | (x_i, a) and its mirror image |
| `pair` | (x_i, a) |

The manner of an action is its name without that of its target: PUSH of PUSH_LEFT. A mirror swaps
states within reach, and with them the actions of the same manner that are aimed at them.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Iterator
from typing import NamedTuple

import numpy as np

from likeme_inference.tabletop.arrays import FloatArray, IntArray
from likeme_inference.tabletop.finite_domain import Domain

#: In the order of the variances.
COMPONENTS = ('all', 'direction', 'manner', 'mirror', 'pair')
#: With more states within reach no mirror is looked for: there are too many.
MIRRORED_STATES = 6

#: Image of each state, shape [x]; its own inverse.
Mirror = tuple[int, ...]


class RowKernel(NamedTuple):
    """The components over all rows.

    Attributes:
        pairs: x_i and a of each row, shape [row, 2].
        aims: target of the action of each row, shape [row].
        components: 1 where two rows have the same label, shape [component, row, row]; all 0 for a
            component that tells no more apart than one before it.
    """

    pairs: IntArray
    aims: IntArray
    components: FloatArray

    def trials(self, counts: FloatArray) -> FloatArray:
        """Counts [object, x_i, a, x_f] of the rows, shape [object, row, x_f]."""
        x, a = self.pairs.T
        return np.asarray(counts[:, x, a])

    def succeeded(self, trials: FloatArray) -> tuple[FloatArray, FloatArray]:
        """How often each row reached its target, and did or left the object where it was.

        trials: shape [object, row, x_f]; both results [object, row].
        """
        rows = np.arange(len(self.pairs))
        reached = trials[:, rows, self.aims]
        return reached, reached + trials[:, rows, self.pairs[:, 0]]


def row_kernel(domain: Domain, mirror: Mirror | None = None) -> RowKernel:
    """The components in a domain.

    mirror: one of `mirrors`; None: no symmetry.

    Raises:
        ValueError: an action is aimed at no single state.
    """
    aims = domain.state_aims
    pairs = [
        (x, a)
        for x in range(len(domain.states))
        for a, aim in enumerate(aims)
        if not domain.stuck[x] and aim != x
    ]
    beyond = [bool(domain.stuck[aims[a]]) for _, a in pairs]
    manners = [manner_of(domain, a) for _, a in pairs]
    labels: dict[str, Iterable[Hashable]] = {
        'all': [None] * len(pairs),
        'direction': beyond,
        'manner': zip(beyond, manners, strict=True),
        'pair': pairs,
    }
    if mirror is not None:
        labels['mirror'] = [frozenset((pair, _image(domain, mirror, *pair))) for pair in pairs]
    components, seen = np.zeros((len(COMPONENTS), len(pairs), len(pairs))), []
    for component, name in zip(components, COMPONENTS, strict=True):
        numbered = _numbered(labels.get(name, ()))
        # Two components that tell the same apart would only split a variance.
        if numbered and numbered not in seen:
            seen.append(numbered)
            component[:] = np.equal.outer(numbered, numbered)
    rows = np.array(pairs, dtype=np.int64).reshape(-1, 2)
    return RowKernel(rows, np.array(aims, dtype=np.int64)[rows[:, 1]], components)


def mirrors(domain: Domain) -> Iterator[Mirror]:
    """Every permutation of the states within reach that is its own inverse, but the identity.

    None for a domain with more than MIRRORED_STATES of them.
    """
    open_ = np.flatnonzero(~domain.stuck).tolist()
    if len(open_) > MIRRORED_STATES:
        return
    for swaps in _matchings(open_):
        image = list(range(len(domain.states)))
        for one, other in swaps:
            image[one], image[other] = other, one
        if swaps:
            yield tuple(image)


def manner_of(domain: Domain, action: int) -> str:
    """The name of an action without that of its target; the whole name if it is not in it."""
    name, target = domain.actions[action], domain.states[domain.state_aims[action]]
    return name.replace(target, '').strip('_- ') or name


def _matchings(items: list[int]) -> Iterator[list[tuple[int, int]]]:
    """All sets of disjoint pairs."""
    if not items:
        yield []
        return
    first, *rest = items
    yield from _matchings(rest)
    for other in rest:
        for more in _matchings([item for item in rest if item != other]):
            yield [(first, other), *more]


def _image(domain: Domain, mirror: Mirror, x: int, a: int) -> tuple[int, int]:
    """The mirror image of a row; itself if no action of the manner is aimed there."""
    manner, target = manner_of(domain, a), mirror[domain.state_aims[a]]
    for b, aim in enumerate(domain.state_aims):
        if aim == target and manner_of(domain, b) == manner:
            return mirror[x], b
    return x, a


def _numbered(labels: Iterable[Hashable]) -> list[int]:
    """Each label as the number of its first appearance."""
    numbers: dict[Hashable, int] = {}
    return [numbers.setdefault(label, len(numbers)) for label in labels]

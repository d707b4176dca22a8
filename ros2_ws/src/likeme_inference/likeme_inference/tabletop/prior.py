"""What the trials of other objects say of one object."""

from __future__ import annotations

from enum import StrEnum


class Prior(StrEnum):
    """Which prior of p(X_f | X_i, A) is used."""

    #: That of the object's own trials alone: a pseudo-count for every final state, or none.
    OWN = 'own'
    #: A share of the other objects' trials of the same pair, see shared_prior.py.
    SHARED = 'shared'
    #: What it has in common with other objects, pairs and directions, see structured_prior.py.
    STRUCTURED = 'structured'

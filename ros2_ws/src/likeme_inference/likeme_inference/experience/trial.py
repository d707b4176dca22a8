"""One trial of the robot as a fact: what it did to an object, and what the camera saw of it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from hashlib import sha256
from typing import NamedTuple
from uuid import UUID, uuid5

import numpy as np
from numpy.typing import NDArray

from likeme_core.outcomes import MotionOutcome
from likeme_core.tabletop import Action, State

#: Counts of one robot's trials: object -> counts[x_i, a, x_f].
Counts = Mapping[str, NDArray[np.int64]]

#: Name space of the identities (RFC 9562, version 5).
_TRIALS = UUID('6f0c6a5e-3d0b-5a63-9f0e-7b1f6f3f2c11')
#: How a motion may end for a trial to count. The others were stopped or never begun by something
#: that is not the robot's skill: held, busy, expired, the object not seen.
COUNTED = frozenset(
    {
        MotionOutcome.COMPLETED,
        MotionOutcome.NOT_GRASPED,
        MotionOutcome.NO_IK_SOLUTION,
        MotionOutcome.OBJECT_OFFTABLE,
    }
)


class Pair(NamedTuple):
    """What to try: an object, the state it is put in, and an action."""

    object: str
    x_i: State
    action: Action


class Place(NamedTuple):
    """Where the camera saw an object: centroid, m, and major axis, rad, in base_link."""

    x: float
    y: float
    yaw: float


@dataclass(frozen=True)
class TrialKey:
    """Which trial: the same key names the same trial, whoever makes it, wherever it is kept.

    Attributes:
        robot: the body, by a name that changes when the body does.
        campaign: a series of trials with one seed, e.g. 'offline-1'.
        repetition: counts the trials of this pair in this campaign, from 0.
    """

    robot: str
    campaign: str
    pair: Pair
    repetition: int

    def __post_init__(self) -> None:
        for name in (self.robot, self.campaign, self.pair.object):
            printable = 0 < len(name) <= 100 and name.isprintable() and name == name.strip()
            # Text files of trials and models say something else by these.
            if not printable or name.startswith('#') or name == 'end':
                raise ValueError(
                    'Expected a name of 1 to 100 printable characters, without spaces around it '
                    f'or a # in front, and not "end", got {name!r}.'
                )
        if self.repetition < 0:
            raise ValueError(f'Expected a repetition of 0 or more, got {self.repetition}.')

    @property
    def identity(self) -> str:
        """A UUID that follows from the key alone."""
        return str(uuid5(_TRIALS, self._text()))

    def seed(self, campaign_seed: int, attempt: int = 0) -> int:
        """The trial's own seed, 0 to 2^63 - 1: independent of every other trial's.

        attempt: counts the tables that had to be set up anew because the camera did not see x_i.
        """
        text = f'{campaign_seed}/{attempt}/{self._pair_text()}'
        return int.from_bytes(sha256(text.encode()).digest()[:8], 'big') >> 1

    def _text(self) -> str:
        return json.dumps([self.robot, self.campaign, self._pair_text()])

    def _pair_text(self) -> str:
        pair = self.pair
        return json.dumps([pair.object, pair.x_i.name, pair.action.name, self.repetition])


@dataclass(frozen=True)
class Trial:
    """What became of a trial.

    Attributes:
        x_f: by the camera, when all was at rest again.
        before, after: where the camera saw the object; None where it did not.
        motion: how the arm says its motion ended.
        seed: of everything that was drawn for it.
        version: of the software.
        time: when it was recorded, ns since the epoch.
    """

    key: TrialKey
    x_f: State
    motion: MotionOutcome
    seed: int
    version: str
    time: int
    before: Place | None = None
    after: Place | None = None

    def __post_init__(self) -> None:
        if self.motion not in COUNTED:
            raise ValueError(f'Expected a motion that counts as a trial, got {self.motion.name}.')
        if not 0 <= self.seed < 2**63:
            raise ValueError(f'Expected a seed of 0 to 2^63 - 1, got {self.seed}.')

    def contradicts(self, other: Trial) -> bool:
        """Whether two records of the same trial differ in what happened."""
        mine, theirs = (self.x_f, self.motion), (other.x_f, other.motion)
        return self.key == other.key and mine != theirs


def no_counts(objects: tuple[str, ...]) -> dict[str, NDArray[np.int64]]:
    """Counts before the first trial."""
    shape = len(State), len(Action), len(State)
    return {name: np.zeros(shape, dtype=np.int64) for name in objects}

"""A trial: an action on an object, and the result observed by the camera."""

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
from likeme_core.world import World

#: Counts of one robot's trials: object -> counts[x_i, a, x_f].
Counts = Mapping[str, NDArray[np.int64]]

#: Name space of the identities (RFC 9562, version 5).
_TRIALS = UUID('6f0c6a5e-3d0b-5a63-9f0e-7b1f6f3f2c11')
#: Motion outcomes that count as a trial. The others were stopped or not started for reasons
#: unrelated to the action: held, busy, expired, object not seen, other objects in the way.
COUNTED = frozenset(
    {
        MotionOutcome.COMPLETED,
        MotionOutcome.NOT_GRASPED,
        MotionOutcome.NO_IK_SOLUTION,
        MotionOutcome.OBJECT_OFFTABLE,
    }
)


class Pair(NamedTuple):
    """An object, its initial state, and an action."""

    object: str
    x_i: State
    action: Action


class Place(NamedTuple):
    """Observed pose of an object: centroid, m, and major axis, rad, in base_link."""

    x: float
    y: float
    yaw: float


def check_name(name: str) -> None:
    """Check the name of a robot, a campaign or an object.

    Raises:
        ValueError: a name that a trial file or a database row cannot hold.
    """
    printable = 0 < len(name) <= 100 and name.isprintable() and name == name.strip()
    # A leading # starts a comment in trial and model files, "end" their last line.
    if not printable or name.startswith('#') or name == 'end':
        raise ValueError(
            'Expected a name of 1 to 100 printable characters, without spaces around it '
            f'or a # in front, and not "end", got {name!r}.'
        )


@dataclass(frozen=True)
class TrialKey:
    """Key of a trial, unique across programs and stores.

    Attributes:
        robot: name of the robot's body; changes with the body.
        campaign: name of a series of trials with one seed, e.g. 'offline-1'.
        repetition: number of the trial of this pair in this campaign, from 0.
    """

    robot: str
    campaign: str
    pair: Pair
    repetition: int

    def __post_init__(self) -> None:
        for name in (self.robot, self.campaign, self.pair.object):
            check_name(name)
        if self.repetition < 0:
            raise ValueError(f'Expected a repetition of 0 or more, got {self.repetition}.')

    @property
    def identity(self) -> str:
        """UUID (version 5) of the key."""
        return str(uuid5(_TRIALS, self._text()))

    def seed(self, campaign_seed: int, attempt: int = 0) -> int:
        """Seed of the trial, 0 to 2^63 - 1, independent of those of other trials.

        attempt: number of set-ups repeated because the camera did not observe x_i.
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
    """A trial and its result.

    Attributes:
        x_f: final state observed by the camera, everything at rest.
        before, after: observed poses of the object; None if not visible.
        motion: reported by the arm.
        seed: of all random numbers of the trial.
        version: of the software.
        time: of recording, ns since the epoch.
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
        """Whether two records of the same trial have different results."""
        mine, theirs = (self.x_f, self.motion), (other.x_f, other.motion)
        return self.key == other.key and mine != theirs


def no_counts(world: World, objects: tuple[str, ...]) -> dict[str, NDArray[np.int64]]:
    """Zero counts."""
    states = len(world.states)
    shape = states, len(world.actions), states
    return {name: np.zeros(shape, dtype=np.int64) for name in objects}

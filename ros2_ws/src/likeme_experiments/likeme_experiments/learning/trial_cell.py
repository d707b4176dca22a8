"""A trial as a pure function: the same key and campaign seed give the same trial, anywhere."""

from __future__ import annotations

import threading
import time
from functools import cache
from hashlib import sha256
from importlib.metadata import PackageNotFoundError, version

import cv2

from likeme_arm_sim.cell import CellSettings
from likeme_arm_sim.headless_trial import single_object_cell
from likeme_arm_sim.scene import Scene
from likeme_core.outcomes import Actor, MotionOutcome
from likeme_experiments.learning.observed_cell import Eyes
from likeme_inference.experience.trial import COUNTED, Place, Trial, TrialKey
from likeme_perception.catalogue import load_catalogue
from likeme_perception.config import PerceptionConfig
from likeme_perception.observation import ObjectObservation

#: Of what stays the same in all trials: the sensor's flaws and the first look at the scene.
BODY_SEED = 0
#: Tables that are set up for one trial before it is given up.
ATTEMPTS = 5
#: Changes when trials are made in another way than before.
PROTOCOL = 2


class TrialFailedError(Exception):
    """A trial could not be made, for a reason that says nothing about the robot's skill."""


class TrialCell:
    """A cell with one object in it, in which trials are made that know nothing of one another."""

    def __init__(self, name: str, settings: CellSettings | None = None) -> None:
        """name: of the object. settings: of the cell, but for its initial states."""
        self._name = name
        self._cell = single_object_cell(name, settings)
        self._config, self._known = PerceptionConfig(), load_catalogue()
        self._cell.restart(BODY_SEED)
        self._background = Eyes(self._cell, self._config, self._known, None).learn_background()

    def run(self, key: TrialKey, campaign_seed: int) -> Trial:
        """Make one trial: x_i, the place acted at and x_f are what the camera saw.

        Raises:
            TrialFailedError: the camera did not see x_i, or the arm was not free to act.
        """
        reason = ''
        for attempt in range(ATTEMPTS):
            seed = key.seed(campaign_seed, attempt)
            try:
                return self._attempt(key, seed)
            except TrialFailedError as error:
                reason = str(error)
        raise TrialFailedError(reason)

    def _attempt(self, key: TrialKey, seed: int) -> Trial:
        cell, name, x_i = self._cell, self._name, key.pair.x_i
        cell.restart(seed)
        cell.reset([name], [x_i], seed)
        eyes = Eyes(cell, self._config, self._known, self._background)
        before = eyes.at_rest().object(name)
        if before.state is not x_i:
            raise TrialFailedError(
                f'Expected to see the {name} {x_i.name}, got {before.state_name}.'
            )
        eyes.look_out_for(key.pair.action.target)
        motion = cell.run_action(Actor.ROBOT, name, key.pair.action, eyes.look)
        after = eyes.at_rest().object(name)
        outcome = MotionOutcome(int(motion.outcome))
        if outcome not in COUNTED or after.state is None:
            raise TrialFailedError(f'{motion.message} It was seen {after.state_name} then.')
        return Trial(
            key, after.state, outcome, seed, software_version(), time.time_ns(),
            place_of(before), place_of(after),
        )  # fmt: skip


def place_of(seen: ObjectObservation) -> Place | None:
    """Where an object was seen; None when it was not."""
    if not seen.visible or seen.shape is None:
        return None
    x, y, _ = seen.centroid
    return Place(float(x), float(y), float(seen.shape.yaw))


@cache
def simulated_robot() -> str:
    """The name of the body that trials are made with; another body has another name.

    Everything that may change how a trial ends and is a number is part of it: the scene, the
    physics, the arm's primitives, the sensor, perception.
    """
    body = PROTOCOL, Scene(), CellSettings(initial_states={}), PerceptionConfig()
    return f'sim-{sha256(repr(body).encode()).hexdigest()[:8]}'


def software_version() -> str:
    """The version of this package, as it is installed."""
    try:
        return version('likeme_experiments')
    except PackageNotFoundError:
        return 'unknown'


_CELLS = threading.local()


def make_trial(key: TrialKey, campaign_seed: int) -> Trial:
    """Make one trial in this process (and thread), in a cell that is kept for the next one.

    Raises:
        TrialFailedError: see TrialCell.run; or the key is of another body than this process has.
    """
    if key.robot != simulated_robot():
        raise TrialFailedError(
            f'Expected the software of the body {key.robot}, got that of {simulated_robot()}.'
        )
    # A trial is one thread's work; OpenCV's would wait for other trials' cores.
    cv2.setNumThreads(1)
    cells: dict[str, TrialCell] = _CELLS.__dict__.setdefault('by_object', {})
    name = key.pair.object
    if name not in cells:
        cells[name] = TrialCell(name)
    return cells[name].run(key, campaign_seed)

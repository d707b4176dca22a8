"""A trial as a pure function: the same key and campaign seed give the same trial, anywhere."""

from __future__ import annotations

import threading
import time
from importlib.metadata import PackageNotFoundError, version

import cv2

from likeme_arm_sim.cell import CellSettings
from likeme_arm_sim.headless_trial import single_object_cell
from likeme_core.outcomes import Actor, MotionOutcome
from likeme_core.world import World, load_world
from likeme_experiments.learning.cell_perception import CellPerception
from likeme_experiments.learning.robot_identity import simulated_robot
from likeme_inference.experience.trial import COUNTED, Place, Trial, TrialKey
from likeme_perception.catalogue import world_catalogue
from likeme_perception.config import world_config
from likeme_perception.observation import ObjectObservation

#: Seed of what is the same in all trials: the sensor's fixed pattern and the background.
BODY_SEED = 0
#: Start tables that are tried for one trial before it is given up.
ATTEMPTS = 5


class TrialFailedError(Exception):
    """A trial could not be made, for a reason other than the robot's skill."""


class TrialCell:
    """A cell with one object, in which independent trials are made one after another."""

    def __init__(self, world: World, name: str, settings: CellSettings | None = None) -> None:
        """name: of the object. settings: of the cell, but for its initial states."""
        self._name = name
        self._cell = single_object_cell(world, name, settings)
        self._config, self._known = world_config(world), world_catalogue(world)
        self._cell.restart(BODY_SEED)
        first = CellPerception(self._cell, self._config, self._known, None)
        self._background = first.learn_background()

    def run(self, key: TrialKey, campaign_seed: int) -> Trial:
        """Make one trial: x_i, the place acted at and x_f are what the camera saw.

        Raises:
            TrialFailedError: the camera did not see x_i, or the arm did not try.
        """
        reason = ''
        for attempt in range(ATTEMPTS):
            seed = key.seed(campaign_seed, attempt)
            try:
                return self._attempt(key, seed)
            except TrialFailedError as error:
                reason = str(error)
        raise TrialFailedError(reason)

    def close(self) -> None:
        """Disconnect the physics client."""
        self._cell.physics_world.client.disconnect()

    def _attempt(self, key: TrialKey, seed: int) -> Trial:
        cell, name, x_i = self._cell, self._name, key.pair.x_i
        cell.restart(seed)
        cell.reset([name], [x_i], seed)
        perception = CellPerception(cell, self._config, self._known, self._background)
        before = perception.wait_until_settled().object(name)
        if before.state != x_i:
            raise TrialFailedError(
                f'Expected to see the {name} {x_i.name}, got {before.state_name}.'
            )
        perception.expect_state(key.pair.action.target)
        motion = cell.run_action(Actor.ROBOT, name, key.pair.action, perception.look)
        after = perception.wait_until_settled().object(name)
        outcome = MotionOutcome(int(motion.outcome))
        if outcome not in COUNTED or after.state is None:
            raise TrialFailedError(f'{motion.message} The camera saw {after.state_name}.')
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


def software_version() -> str:
    """The installed version of this package."""
    try:
        return version('likeme_experiments')
    except PackageNotFoundError:
        return 'unknown'


#: Cells by object, one set for each thread of a worker process: an executor cannot pass them in.
_CELLS = threading.local()


def make_trial(key: TrialKey, campaign_seed: int, source: str) -> Trial:
    """Make one trial in this worker's cell of the object, which is kept for the next one.

    source: of the world, see World.source.

    Raises:
        TrialFailedError: see TrialCell.run; or the key is of another robot than this software's.
    """
    world = load_world(source)
    if key.robot != simulated_robot(world):
        raise TrialFailedError(
            f'Expected the software of the robot {key.robot}, got {simulated_robot(world)}.'
        )
    # One trial uses one core; OpenCV's threads would compete with the other trials.
    cv2.setNumThreads(1)
    cells: dict[tuple[str, str], TrialCell] = _CELLS.__dict__.setdefault('by_object', {})
    name = source, key.pair.object
    if name not in cells:
        cells[name] = TrialCell(world, key.pair.object)
    return cells[name].run(key, campaign_seed)

"""An episode as a pure function: the same case, seed and model give the same one, anywhere."""

from __future__ import annotations

from functools import lru_cache
from hashlib import sha256
from typing import NamedTuple

import cv2

from likeme_arm_sim.cell import Cell
from likeme_core.tabletop import Mode
from likeme_core.world import World, load_world
from likeme_experiments.evaluation.demonstrations import changes_of
from likeme_experiments.evaluation.episode import (
    ImitationEpisode,
    ImitationResult,
    PerceivedDemonstration,
)
from likeme_experiments.evaluation.forecast import DemonstrationCase, Estimate
from likeme_experiments.imitation.demonstration import demonstrate, temporary_cell
from likeme_experiments.imitation.imitate import imitate, settings_of
from likeme_experiments.imitation.imitation_cell import ImitationCell
from likeme_experiments.learning.trial_cell import ATTEMPTS
from likeme_inference.tabletop.dirichlet import CONCENTRATION
from likeme_inference.tabletop.model_parser import parse
from likeme_inference.tabletop.prior import Prior
from likeme_inference.tabletop.robot_model import RobotModel

#: Estimates of p(X_f | X_i, A) the robot may act on.
ESTIMATES = {
    'maximum likelihood': Estimate(),
    'Dirichlet': Estimate(CONCENTRATION),
    'shared prior': Estimate(prior=Prior.SHARED),
}


class EpisodeTask(NamedTuple):
    """One episode to be made."""

    case: DemonstrationCase
    seed: int

    def seed_for(self, purpose: str, attempt: int = 0) -> int:
        """A seed for each purpose, 0 to 2^63 - 1; no trial of learning has it."""
        name, x_i, x_f, manner = self.case
        text = f'imitated/{self.seed}/{purpose}/{attempt}/{name}/{x_i:d}/{x_f:d}/{manner:d}'
        return int.from_bytes(sha256(text.encode()).digest()[:8], 'big') >> 1


class EpisodeFailedError(Exception):
    """An episode cannot be made, for a reason other than the robot's skill."""


def tasks(world: World, objects: tuple[str, ...], seeds: int) -> list[EpisodeTask]:
    """Every interesting demonstration of every object; all of one seed before the next."""
    cases = [
        DemonstrationCase(o, *change, m)
        for m in world.manners
        for o in objects
        for change in changes_of(world)
        if world.action_of(m, change[1]) is not None
    ]
    return [EpisodeTask(case, seed) for seed in range(seeds) for case in cases]


def make_episode(
    task: EpisodeTask, model_text: str, source: str, together: bool = False
) -> ImitationEpisode:
    """Make one episode: a human demonstrates, the robot imitates in every mode.

    model_text: the robot's model, as a model file. source: of the world, see World.source.
    together: with all objects of the world on the table.

    Raises:
        EpisodeFailedError: the camera does not see the object in its start state.
    """
    # One episode uses one core; OpenCV's threads would compete with the other episodes.
    cv2.setNumThreads(1)
    model, world = _model(model_text), load_world(source)
    found = demonstrate(world, task.case, task.seed_for('shown'), together)
    results: dict[str, dict[Mode, ImitationResult]] = {name: {} for name in ESTIMATES}
    if found:
        with temporary_cell(world, task.case.object, together) as cell:
            start = _start(world, task, cell)
            for name, estimate in ESTIMATES.items():
                for mode in Mode:
                    settings = settings_of(world, mode, estimate)
                    results[name][mode] = imitate(start, model, settings, found)
    seen = tuple(PerceivedDemonstration(int(d.x_i), int(d.x_f), int(d.manner)) for d in found)
    return ImitationEpisode(task.case, task.seed, seen, results)


def _start(world: World, task: EpisodeTask, cell: Cell) -> ImitationCell:
    """The object in the start state, by the first seed for which the camera sees it there."""
    name, x_i, *_ = task.case
    for attempt in range(ATTEMPTS):
        start = ImitationCell(world, cell, name, x_i, task.seed_for('put back', attempt))
        if start.start.states.get(name) == x_i:
            return start
    raise EpisodeFailedError(
        f'Expected to see the {name} {x_i.name}, got '
        f'{start.start.states.get(name)} in {ATTEMPTS} attempts.'
    )


@lru_cache(maxsize=4)
def _model(text: str) -> RobotModel:
    return parse(text)

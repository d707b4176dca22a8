"""An episode as a pure function: the same case, seed and model give the same one, anywhere."""

from __future__ import annotations

from functools import lru_cache
from hashlib import sha256
from typing import NamedTuple

import cv2

from likeme_core.tabletop import Manner, Mode
from likeme_experiments.evaluation.demonstrations import CHANGES
from likeme_experiments.evaluation.episode import Act, Ending, Episode
from likeme_experiments.evaluation.forecast import Case, Estimate
from likeme_experiments.imitation.demonstration import shown
from likeme_experiments.imitation.imitate import imitate, settings_of
from likeme_experiments.imitation.imitation_cell import Stage
from likeme_experiments.learning.trial_cell import ATTEMPTS
from likeme_inference.tabletop.dirichlet import CONCENTRATION
from likeme_inference.tabletop.model_parser import parse
from likeme_inference.tabletop.robot_model import RobotModel

#: Estimates of p(X_f | X_i, A) the robot may act on.
ESTIMATES = {
    'maximum likelihood': Estimate(),
    'Dirichlet': Estimate(CONCENTRATION),
    'shared prior': Estimate(shared=True),
}


class Task(NamedTuple):
    """One episode to be made."""

    case: Case
    seed: int

    def chance(self, purpose: str, attempt: int = 0) -> int:
        """A seed of its own for each purpose, 0 to 2^63 - 1; no trial of learning has it."""
        name, x_i, x_f, manner = self.case
        text = f'imitated/{self.seed}/{purpose}/{attempt}/{name}/{x_i:d}/{x_f:d}/{manner:d}'
        return int.from_bytes(sha256(text.encode()).digest()[:8], 'big') >> 1


class EpisodeFailedError(Exception):
    """An episode cannot be made, for a reason that says nothing about the robot's skill."""


def tasks(objects: tuple[str, ...], seeds: int) -> list[Task]:
    """Every interesting demonstration of every object; all of one seed before the next."""
    cases = [Case(o, *change, m) for m in Manner for o in objects for change in CHANGES]
    return [Task(case, seed) for seed in range(seeds) for case in cases]


def make_episode(task: Task, model_text: str) -> Episode:
    """Make one episode in this process: the person shows, the robot imitates in every mode.

    model_text: the robot's model, as a model file.

    Raises:
        EpisodeFailedError: the camera does not see the object where it was put back.
    """
    # An episode is one thread's work; OpenCV's would wait for other episodes' cores.
    cv2.setNumThreads(1)
    model = _model(model_text)
    acts = shown(task.case, task.chance('shown'))
    endings: dict[str, dict[Mode, Ending]] = {name: {} for name in ESTIMATES}
    if acts:
        stage = _stage(task)
        for name, estimate in ESTIMATES.items():
            for mode in Mode:
                settings = settings_of(mode, estimate)
                endings[name][mode] = imitate(stage, model, settings, acts)
    seen = tuple(Act(int(a.x_i), int(a.x_f), int(a.manner)) for a in acts)
    return Episode(task.case, task.seed, seen, endings)


def _stage(task: Task) -> Stage:
    """The object put back to where the person took it, by a seed by which the camera sees it."""
    name, x_i, *_ = task.case
    for attempt in range(ATTEMPTS):
        stage = Stage(name, x_i, task.chance('put back', attempt))
        if stage.beginning.states.get(name) == x_i:
            return stage
    raise EpisodeFailedError(
        f'Expected to see the {name} {x_i.name}, got '
        f'{stage.beginning.states.get(name)} in {ATTEMPTS} attempts.'
    )


@lru_cache(maxsize=4)
def _model(text: str) -> RobotModel:
    return parse(text)

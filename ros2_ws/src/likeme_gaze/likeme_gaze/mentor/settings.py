"""Parameters of the gaze node: names, defaults, ranges, and the settings read from them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from enum import StrEnum
from typing import Any, NamedTuple

import numpy as np

from likeme_core.settings import Setting
from likeme_gaze import GazeModel, Pose2, SimulationSetup, blindfolded_experience, self_experience
from likeme_gaze.mentor.head_pose import CM_PER_M, MAX_POSITION, Frames, in_cm


class BlindfoldExperience(StrEnum):
    """The robot's own experience under a blindfold (the groups of Fig 6)."""

    NONE = 'none'
    WINDOWED = 'windowed'
    OPAQUE = 'opaque'


#: In the order in which they are declared; m, rad, s.
SETTINGS: dict[str, Setting] = {
    'seed': Setting(1, "seed of the robot's simulated self-experience", (0, 2**31 - 1)),
    'training_points': Setting(
        200, 'head movements to train on, and as many under a blindfold', (0, 1000)
    ),
    'angle_noise': Setting(math.radians(3), 'standard deviation of head turns, rad', (1e-3, 0.5)),
    'distance_noise': Setting(0.1, 'standard deviation of fixation distances, m', (1e-3, 2.0)),
    'blindfold_experience': Setting(
        str(BlindfoldExperience.NONE),
        f'own experience under a blindfold: {", ".join(BlindfoldExperience)}',
    ),
    'mentor_blindfolded': Setting(False, "whether the mentor's eyes are covered"),
    'observations': Setting(
        5, 'head poses after the start pose before the robot turns its head', (1, 100)
    ),
    'use_distance': Setting(
        False, 'whether each head pose needs a mentor/fixation_distance of the same stamp'
    ),
    'prior_offset': Setting(
        [0.0, 0.0],
        'mean of the goal prior relative to the midpoint of robot and mentor: x y in '
        'base_frame, m',
    ),
    'prior_std': Setting(
        [1.15, 2.89],
        'standard deviations of the goal prior along and across the line to the mentor, m; the '
        "default is that of the training goals, the authors' code has 2.83 1.41",
    ),
    'base_frame': Setting('base_link', "the robot's frame: x forward, y left, z up"),
    'robot_head': Setting(
        [0.0, 0.0, 0.0], 'pose of the head in base_frame at neck angle 0: x y, m, and heading, rad'
    ),
    'robot_heading': Setting(
        0.0, 'neck angle during observation, rad, left positive', (-math.pi, math.pi)
    ),
    'mentor_frame': Setting('mentor', 'second frame that head poses may be given in'),
    'mentor_pose': Setting(
        [6.0, 0.0, math.pi], 'pose of mentor_frame in base_frame: x y, m, and heading, rad'
    ),
    'most_moved': Setting(
        0.3, "largest distance of the mentor's head from its start position, m", (0.0, 10.0)
    ),
    'head_joint': Setting('head_pan_joint', 'name of the neck joint in head_command'),
    'turn_time': Setting(1.0, 'duration of a head turn, s', (0.0, 60.0)),
}


class LearningSettings(NamedTuple):
    """What the gaze model is trained on; a change of any of these trains it again."""

    seed: int
    points: int
    setting: SimulationSetup
    blindfold: BlindfoldExperience

    def model(self) -> GazeModel:
        """Train on simulated self-experience; about 1 s for 200 points.

        Under a windowed blindfold targets are visible, so movements follow the same model as
        without one; under an opaque blindfold they are independent of the goal.

        Raises:
            ValueError: too few points.
        """
        rng = np.random.default_rng(self.seed)
        open_eyes = self_experience(rng, self.points, self.setting)
        blindfolded = None
        if self.blindfold is BlindfoldExperience.WINDOWED:
            blindfolded = self_experience(rng, self.points, self.setting)
        elif self.blindfold is BlindfoldExperience.OPAQUE:
            blindfolded = blindfolded_experience(rng, self.points, self.setting)
        return GazeModel.learned(open_eyes, blindfolded, seed=self.seed)


class TrackingSettings(NamedTuple):
    """How a mentor is tracked.

    Attributes:
        frames: of head poses.
        head, heading: the robot's head in its frame, cm and rad, and the neck angle, rad.
        prior_offset: of the goal prior's mean from the midpoint of robot and mentor, cm.
        prior_std: along and across the line to the mentor, cm.
        observations: head poses per trial.
        use_distance: whether every observation has a fixation distance.
        blindfolded: whether the mentor's eyes are covered.
        most_moved: largest distance of the head from its start position, cm.
    """

    frames: Frames
    head: Pose2
    heading: float
    prior_offset: tuple[float, float]
    prior_std: tuple[float, float]
    observations: int
    use_distance: bool
    blindfolded: bool
    most_moved: float


class GazeSettings(NamedTuple):
    """All settings of the node; turn_time in s."""

    learning: LearningSettings
    tracking: TrackingSettings
    head_joint: str
    turn_time: float


def read_settings(values: Mapping[str, Any]) -> GazeSettings:
    """Read settings from the values of all parameters.

    Raises:
        ValueError: a value that is not allowed.
    """
    joint = _name(values, 'head_joint')
    return GazeSettings(_learning(values), _tracking(values), joint, float(values['turn_time']))


def _learning(values: Mapping[str, Any]) -> LearningSettings:
    blindfold = values['blindfold_experience']
    if blindfold not in set(BlindfoldExperience):
        raise ValueError(
            f'Expected blindfold_experience to be one of {", ".join(BlindfoldExperience)}, '
            f'got {blindfold!r}.'
        )
    setting = SimulationSetup(
        angle_std=float(values['angle_noise']),
        distance_std=float(values['distance_noise']) * CM_PER_M,
    )
    return LearningSettings(
        values['seed'], values['training_points'], setting, BlindfoldExperience(blindfold)
    )


def _tracking(values: Mapping[str, Any]) -> TrackingSettings:
    along, across = _numbers(values, 'prior_std', 2)
    if min(along, across) <= 0:
        raise ValueError(f'Expected prior_std of more than 0 m, got {min(along, across):g}.')
    dx, dy = _numbers(values, 'prior_offset', 2)
    return TrackingSettings(
        _frames(values),
        in_cm(_numbers(values, 'robot_head', 3)),
        float(values['robot_heading']),
        (dx * CM_PER_M, dy * CM_PER_M),
        (along * CM_PER_M, across * CM_PER_M),
        values['observations'],
        values['use_distance'],
        values['mentor_blindfolded'],
        float(values['most_moved']) * CM_PER_M,
    )


def _frames(values: Mapping[str, Any]) -> Frames:
    base, mentor = _name(values, 'base_frame'), _name(values, 'mentor_frame')
    if base == mentor:
        raise ValueError(
            f'Expected two names for base_frame and mentor_frame, got {base!r} twice.'
        )
    return Frames(base, mentor, in_cm(_numbers(values, 'mentor_pose', 3)))


def _name(values: Mapping[str, Any], key: str) -> str:
    if not values[key]:
        raise ValueError(f'Expected a name as {key}, got an empty string.')
    return str(values[key])


def _numbers(values: Mapping[str, Any], key: str, count: int) -> tuple[float, ...]:
    """A parameter's `count` finite numbers."""
    given = values[key]
    numbers = (
        list(given) if isinstance(given, Iterable) and not isinstance(given, str) else [given]
    )
    finite = all(isinstance(n, int | float) and math.isfinite(n) for n in numbers)
    if len(numbers) != count or not finite:
        raise ValueError(f'Expected {key} as {count} finite numbers, got {numbers}.')
    if max(map(abs, numbers)) > MAX_POSITION:
        raise ValueError(f'Expected {key} within +-{MAX_POSITION:g}, got {numbers}.')
    return tuple(float(number) for number in numbers)

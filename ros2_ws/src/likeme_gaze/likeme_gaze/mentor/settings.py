"""The gaze node's parameters: names, defaults, ranges, and the values they stand for."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from enum import StrEnum
from typing import Any, NamedTuple

import numpy as np

from likeme_core.settings import Setting
from likeme_gaze import GazeModel, Pose2, SimulationSetup, blindfolded_experience, self_experience
from likeme_gaze.mentor.head_pose import CM_PER_M, Frames, in_cm


class Blindfold(StrEnum):
    """What the robot has experienced under a blindfold (the groups of Fig 6)."""

    NONE = 'none'
    WINDOWED = 'windowed'
    OPAQUE = 'opaque'


#: In the order in which they are declared; m, rad, s.
SETTINGS: dict[str, Setting] = {
    'seed': Setting(1, "of the robot's self-experience", (0, 2**31 - 1)),
    'training_points': Setting(
        200, 'head movements the robot learns from, and as many under a blindfold', (0, 1000)
    ),
    'angle_noise': Setting(math.radians(3), 'standard deviation of its turns, rad', (1e-3, 0.5)),
    'distance_noise': Setting(
        0.1, 'standard deviation of the distances it looks at, m', (1e-3, 2.0)
    ),
    'blindfold_experience': Setting(
        str(Blindfold.NONE), f'what it knows of blindfolds: {", ".join(Blindfold)}'
    ),
    'mentor_blindfolded': Setting(False, "whether the mentor's eyes are covered"),
    'observations': Setting(
        5, 'head poses after the start pose until the robot turns its head', (1, 100)
    ),
    'use_distance': Setting(
        False, 'wait for a mentor/fixation_distance with the stamp of each head pose'
    ),
    'prior_offset': Setting(
        [0.0, 0.0],
        'mean of the goal before anything was seen, from halfway to the mentor: x y in '
        'base_frame, m',
    ),
    'prior_std': Setting(
        [1.15, 2.89],
        'its standard deviations along and across the line to the mentor, m; these are of the '
        "robot's own goals, the authors' code has 2.83 1.41",
    ),
    'base_frame': Setting('base_link', "the robot's frame: x forward, y left, z up"),
    'robot_head': Setting(
        [0.0, 0.0, 0.0], 'its head in base_frame with the neck at 0: x y, m, and heading, rad'
    ),
    'robot_heading': Setting(
        0.0, 'angle of the neck while it watches, rad, left positive', (-math.pi, math.pi)
    ),
    'mentor_frame': Setting('mentor', 'a second frame head poses may come in'),
    'mentor_pose': Setting(
        [6.0, 0.0, math.pi], 'where that frame is in base_frame: x y, m, and heading, rad'
    ),
    'most_moved': Setting(
        0.3, "how far the mentor's head may move from its start place, m", (0.0, 10.0)
    ),
    'head_joint': Setting('head_pan_joint', "name of the neck's joint in head_command"),
    'turn_time': Setting(1.0, 's the head takes for its turn', (0.0, 60.0)),
}


class Learning(NamedTuple):
    """What the robot's model of its own head is learned from; a change means learning anew."""

    seed: int
    points: int
    setting: SimulationSetup
    blindfold: Blindfold

    def model(self) -> GazeModel:
        """Learn from simulated self-experience, about a second for 200 points.

        Through windows targets are seen, so what is learned under that blindfold comes from
        movements like all others; under an opaque one they have nothing to do with any goal.

        Raises:
            ValueError: too few points.
        """
        rng = np.random.default_rng(self.seed)
        eyes_open = self_experience(rng, self.points, self.setting)
        worn = None
        if self.blindfold is Blindfold.WINDOWED:
            worn = self_experience(rng, self.points, self.setting)
        elif self.blindfold is Blindfold.OPAQUE:
            worn = blindfolded_experience(rng, self.points, self.setting)
        return GazeModel.learned(eyes_open, worn, seed=self.seed)


class Watching(NamedTuple):
    """How a mentor is watched.

    Attributes:
        frames: of head poses.
        head, heading: the robot's head in its frame, cm and rad, and the neck's angle, rad.
        prior_offset: of the goal's prior mean from halfway to the mentor, robot's frame, cm.
        prior_std: along and across the line to the mentor, cm.
        observations: of one mentor.
        use_distance: whether every observation comes with a distance.
        blindfolded: whether the mentor's eyes are covered.
        most_moved: cm.
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
    """All parameters' values; turn_time in s."""

    learning: Learning
    watching: Watching
    head_joint: str
    turn_time: float


def read_settings(values: Mapping[str, Any]) -> GazeSettings:
    """Make settings of all parameters' values.

    Raises:
        ValueError: a value makes no sense.
    """
    joint = _name(values, 'head_joint')
    return GazeSettings(_learning(values), _watching(values), joint, float(values['turn_time']))


def _learning(values: Mapping[str, Any]) -> Learning:
    known = values['blindfold_experience']
    if known not in set(Blindfold):
        raise ValueError(
            f'Expected blindfold_experience to be one of {", ".join(Blindfold)}, got {known!r}.'
        )
    setting = SimulationSetup(
        angle_std=float(values['angle_noise']),
        distance_std=float(values['distance_noise']) * CM_PER_M,
    )
    return Learning(values['seed'], values['training_points'], setting, Blindfold(known))


def _watching(values: Mapping[str, Any]) -> Watching:
    along, across = _numbers(values, 'prior_std', 2)
    if min(along, across) <= 0:
        raise ValueError(f'Expected prior_std of more than 0 m, got {min(along, across):g}.')
    dx, dy = _numbers(values, 'prior_offset', 2)
    return Watching(
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
        raise ValueError(f'Expected a name as {key}, got an empty one.')
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
    return tuple(float(number) for number in numbers)

"""The inference node's parameters: names, defaults, ranges, and the values they stand for."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from likeme_inference.tabletop import model_file
from likeme_inference.tabletop.domain import Mode
from likeme_inference.tabletop.imitation import Settings
from likeme_inference.tabletop.robot_model import RobotModel


class Range(NamedTuple):
    """A number: default, least, greatest, and what it means."""

    default: float
    least: float
    greatest: float
    description: str


NUMBERS: dict[str, Range] = {
    'help_threshold': Range(0.5, 0, 1, 'interactive asks when predicted success is below'),
    'turn_timeout': Range(60, 1, 3600, 's of stamps in which to put the object back'),
    'turn_delay': Range(
        0.5, 0, 10, 's of stamps settled off the goal before the robot takes its turn'
    ),
    'outcome_timeout': Range(
        10, 0.5, 600, 's, of stamps or of silence, in which to see the outcome'
    ),
    'action_timeout': Range(60, 1, 3600, 's to wait for the answer of the arm'),
    'arm_wait': Range(
        5, 0.1, 600, 's to wait for the arm service, and for the motion to start in'
    ),
}
OTHERS: dict[str, tuple[Any, str]] = {
    'mode': (str(Mode.INTERACTIVE), ', '.join(Mode)),
    'goal_prior': ([1 / 3, 1 / 3, 1 / 3], 'p(LEFT), p(RIGHT), p(OFFTABLE); sums to 1'),
    'model_file': ('', 'path of a model file; empty: the shipped one'),
}


def read_model(path: str) -> RobotModel:
    """Load a model file; an empty path means the shipped one.

    Raises:
        ModelFileError: with line number and reason.
    """
    return model_file.load(Path(path).expanduser()) if path else model_file.shipped()


def read_settings(values: Mapping[str, Any]) -> Settings:
    """Make settings of parameter values.

    Raises:
        ValueError: for a mode that is none, or a prior that is no distribution.
    """
    if values['mode'] not in set(Mode):
        raise ValueError(f'Expected one of the modes {", ".join(Mode)}, got {values["mode"]!r}.')
    return Settings(
        mode=Mode(values['mode']),
        threshold=values['help_threshold'],
        goal_prior=tuple(values['goal_prior']),
        turn_timeout=values['turn_timeout'],
        turn_delay=values['turn_delay'],
        outcome_timeout=values['outcome_timeout'],
    )

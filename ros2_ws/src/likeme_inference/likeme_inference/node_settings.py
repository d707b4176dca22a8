"""The inference node's parameters: names, defaults, ranges, and the values they stand for."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, NamedTuple

from likeme_inference.experience.executed import Experience
from likeme_inference.experience.store import ExperienceStore
from likeme_inference.tabletop import model_file
from likeme_inference.tabletop.domain import Mode, Policy
from likeme_inference.tabletop.imitation import Settings
from likeme_inference.tabletop.robot_model import RobotModel

#: These are taken once, at the start.
READ_ONLY = frozenset({'experience_store', 'robot'})
#: More would be no plan but stubbornness.
MOST_ACTIONS = 100


class Range(NamedTuple):
    """A number: default, least, greatest, and what it means."""

    default: float
    least: float
    greatest: float
    description: str


NUMBERS: dict[str, Range] = {
    'help_threshold': Range(0.5, 0, 1, 'the robot asks when predicted success is below'),
    'concentration': Range(
        0, 0, 100, 'Dirichlet pseudo-count of every final state; 0: maximum likelihood'
    ),
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
    'policy': (str(Policy.DIRECT), ', '.join(Policy)),
    'action_budget': (3, 'actions the sequential mode may spend on one demonstration, 1 to 100'),
    'shared_prior': (
        False,
        'whether the trials of all objects choose the prior together; concentration is not used',
    ),
    'soft_evidence': (True, "whether perception's probabilities of x_i and x_f count"),
    'goal_prior': ([1 / 3, 1 / 3, 1 / 3], 'p(LEFT), p(RIGHT), p(OFFTABLE); sums to 1'),
    'model_file': ('', 'path of a model file; empty: the shipped one'),
    'experience_store': (
        '',
        'SQLite file or database URL that keeps executed imitations and adds them to the model; '
        'empty: none',
    ),
    'learn_from_outcomes': (True, 'with an experience_store: whether new outcomes go into it'),
    'robot': ('robot', 'whose experience it is, by the name its trials are kept under'),
    'replayed': (False, 'start anew and hear arm and operator from hear_again alone'),
}


def read_model(path: str) -> RobotModel:
    """Load a model file; an empty path means the shipped one.

    Raises:
        ModelFileError: see model_file.load_tabletop.
    """
    if not path:
        return model_file.shipped()
    return model_file.load_tabletop(Path(path).expanduser())


def open_experience(values: Mapping[str, Any], learned: RobotModel) -> Experience | None:
    """Open the store that outcomes go into; None where no store is named.

    Raises:
        StoreError: it cannot be used.
    """
    if not values['experience_store']:
        return None
    # Waiting for somebody else's lock, the node would hear nothing else.
    try:
        software = version('likeme_inference')
    except PackageNotFoundError:
        software = 'not installed'
    store = ExperienceStore(values['experience_store'], patience=1.0)
    store.check_writable()
    return Experience(store, values['robot'], software, learned)


def read_settings(values: Mapping[str, Any]) -> Settings:
    """Make settings of parameter values.

    Raises:
        ValueError: for a mode or policy that is none, or a prior that is no distribution.
    """
    if values['mode'] not in set(Mode):
        raise ValueError(f'Expected one of the modes {", ".join(Mode)}, got {values["mode"]!r}.')
    if values['policy'] not in set(Policy):
        raise ValueError(f'Expected a policy {" or ".join(Policy)}, got {values["policy"]!r}.')
    if not 1 <= values['action_budget'] <= MOST_ACTIONS:
        raise ValueError(
            f'Expected an action_budget from 1 to {MOST_ACTIONS}, got {values["action_budget"]}.'
        )
    return Settings(
        mode=Mode(values['mode']),
        threshold=values['help_threshold'],
        action_budget=values['action_budget'],
        policy=Policy(values['policy']),
        concentration=values['concentration'],
        shared_prior=values['shared_prior'],
        soft_evidence=values['soft_evidence'],
        goal_prior=tuple(values['goal_prior']),
        turn_timeout=values['turn_timeout'],
        turn_delay=values['turn_delay'],
        outcome_timeout=values['outcome_timeout'],
    )

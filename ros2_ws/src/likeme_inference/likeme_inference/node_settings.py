"""Parameters of the inference node: names, defaults, ranges, and the settings read from them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Any

from likeme_core.settings import Setting
from likeme_core.tabletop import Mode
from likeme_core.world import World
from likeme_inference.joint_observer import JointSettings
from likeme_inference.tabletop import model_file
from likeme_inference.tabletop.asking import Asking
from likeme_inference.tabletop.cost_planning import Costs
from likeme_inference.tabletop.domain import Policy
from likeme_inference.tabletop.imitation import Goals, ImitationSettings
from likeme_inference.tabletop.model_parser import ModelFileError
from likeme_inference.tabletop.prior import Prior
from likeme_inference.tabletop.robot_model import RobotModel

if TYPE_CHECKING:
    from likeme_inference.experience.decision_log import DecisionLog
    from likeme_inference.experience.imitation_experience import ImitationExperience

#: Upper limit of action_budget.
MAX_ACTIONS = 100
#: s to wait for other writers of the experience store; the node processes nothing else meanwhile.
LOCK_TIMEOUT = 1.0
#: The same for the decision log, at every attempt. Shorter than HEARTBEAT_TIMEOUT, so that the
#: node does not seem dead; what could not be written is tried again.
LOG_LOCK_TIMEOUT = 0.2
#: Value of decision_log for no log.
NO_LOG = 'none'

#: The parameters whose defaults do not depend on the world.
_COMMON: dict[str, Setting] = {
    'help_threshold': Setting(0.5, 'predicted success below which the robot asks', (0, 1)),
    'asking': Setting(
        str(Asking.THRESHOLD),
        f'{", ".join(Asking)}: what decides whether the robot asks; help_threshold is used by '
        'threshold alone',
    ),
    'promise': Setting(
        0.9,
        'share of episodes in which the goal is reached, help counting, of asking: promise',
        (0, 1),
    ),
    'costs': Setting(
        list(Costs()), 'of an action, help, a mess, waiting, a question, of asking: cost'
    ),
    'concentration': Setting(
        0.0, 'Dirichlet pseudo-count of every final state; 0: maximum likelihood', (0, 100)
    ),
    'turn_timeout': Setting(60.0, 's of stamps in which the object has to be put back', (1, 3600)),
    'turn_delay': Setting(
        0.5, 's of stamps settled off the goal before the robot decides', (0, 10)
    ),
    'outcome_timeout': Setting(
        10.0, 's, of stamps or without a table state, to observe the outcome', (0.5, 600)
    ),
    'action_timeout': Setting(60.0, 's to wait for the response of the arm', (1, 3600)),
    'arm_wait': Setting(
        5.0, 's to wait for the arm service, and for the motion to start', (0.1, 600)
    ),
    'mode': Setting(str(Mode.INTERACTIVE), ', '.join(Mode)),
    'policy': Setting(str(Policy.DIRECT), ', '.join(Policy)),
    'action_budget': Setting(3, 'actions per demonstration in sequential mode, 1 to 100'),
    'prior': Setting(
        str(Prior.OWN),
        f'{", ".join(Prior)}: whether the trials of other objects count; if so, '
        'concentration is not used',
    ),
    'soft_evidence': Setting(True, "whether perception's probabilities of x_i and x_f are used"),
    'model_file': Setting('', 'path of a model file; empty: the one shipped for the world'),
    'experience_store': Setting(
        '',
        'SQLite file or database URL of executed imitations, which are added to the model; '
        'empty: none',
        read_only=True,
    ),
    'learn_from_outcomes': Setting(
        True, 'whether new outcomes are recorded in the experience_store'
    ),
    'robot': Setting('robot', 'robot name under which trials are recorded', read_only=True),
    'decision_log': Setting(
        '',
        'SQLite file or database URL of the decision log; empty: in the experience_store, or '
        "else decision_log.sqlite in the cell's state folder; none: no log",
        read_only=True,
    ),
    'arm_node': Setting(
        'arm_driver', 'name of the node whose heartbeats are those of the arm', read_only=True
    ),
    'goals': Setting('object', 'object, or joint: what is imitated is a goal over all objects'),
    'joint_goals': Setting(
        255, 'greatest number of goals over all objects that are inferred; 0: none are'
    ),
    'stop_delay': Setting(
        5.0, 's of stamps without an act after which a person has stopped', (0.5, 600)
    ),
    'replayed': Setting(False, 'new session with inputs from hear_again alone', kept=False),
}


@cache
def settings_of(world: World) -> dict[str, Setting]:
    """The parameters of the node, with defaults for a world."""
    names, count = ', '.join(f'p({state.name})' for state in world.states), len(world.states)
    prior = {'goal_prior': Setting([1 / count] * count, f'{names}; sums to 1')}
    return _COMMON | prior


def read_model(path: str, world: World) -> RobotModel:
    """Load a model file; an empty path means the one shipped for the world.

    Raises:
        ModelFileError: see model_file.load_tabletop; or none is shipped for the world.
    """
    if not path:
        return model_file.shipped(world)
    try:
        expanded = Path(path).expanduser()
    except RuntimeError as error:
        raise ModelFileError(f'{path}: {error}') from error
    return model_file.load_tabletop(expanded, world)


def open_experience(
    values: Mapping[str, Any], learned: RobotModel, world: World
) -> ImitationExperience | None:
    """Open the experience store; None if no store is named.

    Raises:
        StoreError: it cannot be used.
        ValueError: the robot or an object has a name that no trial can have.
    """
    if not values['experience_store']:
        return None
    # Here, as importing a database takes a node without a store a fifth of its start.
    from likeme_inference.experience.imitation_experience import ImitationExperience
    from likeme_inference.experience.store import ExperienceStore

    try:
        software = version('likeme_inference')
    except PackageNotFoundError:
        software = 'not installed'
    store = ExperienceStore(values['experience_store'], world, lock_timeout=LOCK_TIMEOUT)
    store.check_writable()
    return ImitationExperience(store, values['robot'], software, learned)


def open_decision_log(values: Mapping[str, Any], folder: Callable[[], Path]) -> DecisionLog | None:
    """Open the decision log; None if there shall be none.

    folder: of the cell's state.

    Raises:
        StoreError: it cannot be used.
        OSError: the folder cannot be made.
    """
    place = values['decision_log'] or values['experience_store']
    if place == NO_LOG:
        return None
    # Here, as importing a database takes a node without a log a fifth of its start.
    from likeme_inference.experience.decision_log import LOG_FILE, DecisionLog

    return DecisionLog(place or str(folder() / LOG_FILE), lock_timeout=LOG_LOCK_TIMEOUT)


def read_settings(values: Mapping[str, Any], world: World) -> ImitationSettings:
    """Read settings from parameter values.

    Raises:
        ValueError: an unknown mode or policy, or a prior that is not a distribution.
    """
    if values['mode'] not in set(Mode):
        raise ValueError(f'Expected one of the modes {", ".join(Mode)}, got {values["mode"]!r}.')
    if values['policy'] not in set(Policy):
        raise ValueError(f'Expected a policy {" or ".join(Policy)}, got {values["policy"]!r}.')
    if values['asking'] not in set(Asking):
        raise ValueError(f'Expected asking {", ".join(Asking)}, got {values["asking"]!r}.')
    if values['prior'] not in set(Prior):
        raise ValueError(f'Expected a prior {", ".join(Prior)}, got {values["prior"]!r}.')
    if values['goals'] not in set(Goals):
        raise ValueError(f'Expected goals {" or ".join(Goals)}, got {values["goals"]!r}.')
    if not 1 <= values['action_budget'] <= MAX_ACTIONS:
        raise ValueError(
            f'Expected an action_budget from 1 to {MAX_ACTIONS}, got {values["action_budget"]}.'
        )
    return ImitationSettings(
        world=world,
        mode=Mode(values['mode']),
        goals=Goals(values['goals']),
        threshold=values['help_threshold'],
        action_budget=values['action_budget'],
        policy=Policy(values['policy']),
        concentration=values['concentration'],
        prior=Prior(values['prior']),
        asking=Asking(values['asking']),
        costs=_costs(values['costs']),
        promise=values['promise'],
        soft_evidence=values['soft_evidence'],
        goal_prior=_probabilities('goal_prior', values['goal_prior'], len(world.states)),
        turn_timeout=values['turn_timeout'],
        turn_delay=values['turn_delay'],
        outcome_timeout=values['outcome_timeout'],
    )


def read_joint_settings(values: Mapping[str, Any]) -> JointSettings:
    """Read the settings of goals over all objects from parameter values.

    Raises:
        ValueError: a number of goals below 0.
    """
    if values['joint_goals'] < 0:
        raise ValueError(f'Expected joint_goals of 0 or more, got {values["joint_goals"]}.')
    return JointSettings(values['joint_goals'], values['stop_delay'], values['soft_evidence'])


def _costs(value: Any) -> Costs:
    """A list parameter of the costs in their order; its element type may be anything."""
    names = ', '.join(Costs._fields)
    numbers = not isinstance(value, str) and isinstance(value, Iterable)
    if not numbers or not all(isinstance(c, (int, float)) for c in value):
        raise ValueError(f'Expected the costs of {names}, got {value!r}.')
    if len(value) != len(Costs._fields):
        raise ValueError(f'Expected the costs of {names}, got {list(value)}.')
    return Costs(*(float(cost) for cost in value)).checked()


def _probabilities(name: str, value: Any, count: int) -> tuple[float, ...]:
    """A list parameter of one number per state; its element type may be anything."""
    numbers = not isinstance(value, str) and isinstance(value, Iterable)
    if not numbers or not all(isinstance(p, (int, float)) for p in value) or not len(value):
        raise ValueError(f'Expected {name} as {count} probabilities, got {value!r}.')
    return tuple(value)

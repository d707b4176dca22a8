"""Goal-based imitation: demonstration -> belief -> decision -> help request (Methods)."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from likeme_core.observations import Demonstration, TableSnapshot
from likeme_core.tabletop import Mode
from likeme_core.world import World, load_world
from likeme_inference.tabletop import sentences
from likeme_inference.tabletop.action_selection import Kind, choose
from likeme_inference.tabletop.domain import Policy
from likeme_inference.tabletop.goal_inference import map_goal
from likeme_inference.tabletop.goal_model import GoalModel
from likeme_inference.tabletop.robot_model import RobotModel
from likeme_inference.tabletop.values import Decision, GoalBelief, HelpRequest


@dataclass(frozen=True)
class ImitationSettings:
    """Settings of a decision.

    Attributes:
        threshold: predicted success (sequential: value of the best plan) below which it asks.
        action_budget: actions per demonstration in sequential mode.
        policy: variant of P(A | G, X_i).
        concentration: Dirichlet pseudo-count of every final state; 0: maximum likelihood, as in
            the paper.
        shared_prior: whether a prior fitted to the trials of all objects is used instead.
        soft_evidence: whether perception's probabilities of x_i and x_f are used, or their modes.
        world: its states and actions.
        goal_prior: P(G), indexed by the states; sums to 1. Empty: uniform.
        turn_timeout: s of stamps in which the object must be put back after a demonstration.
        turn_delay: s of stamps for which the object must be settled off the goal before the robot
            decides, so that a demonstration that is still being processed arrives first; 0 once
            the object was observed being put back.
        outcome_timeout: s of stamps in which a settled table state must follow the motion.
    """

    world: World = field(default_factory=load_world)
    mode: Mode = Mode.INTERACTIVE
    threshold: float = 0.5
    action_budget: int = 3
    policy: Policy = Policy.DIRECT
    concentration: float = 0.0
    shared_prior: bool = False
    soft_evidence: bool = True
    goal_prior: tuple[float, ...] = ()
    turn_timeout: float = 60.0
    turn_delay: float = 0.5
    outcome_timeout: float = 10.0

    def __post_init__(self) -> None:
        object.__setattr__(self, 'mode', Mode(self.mode))
        object.__setattr__(self, 'policy', Policy(self.policy))
        count = len(self.world.states)
        object.__setattr__(self, 'goal_prior', tuple(self.goal_prior) or (1 / count,) * count)
        if len(self.goal_prior) != count or not all(p >= 0 for p in self.goal_prior):
            raise ValueError(
                f'Expected {count} probabilities of 0 or more, got {list(self.goal_prior)}.'
            )
        if not math.isclose(sum(self.goal_prior), 1.0, abs_tol=1e-6):
            raise ValueError(f'Expected probabilities to sum to 1, got {sum(self.goal_prior):g}.')
        if not 0 <= self.threshold <= 1:
            raise ValueError(f'Expected a threshold from 0 to 1, got {self.threshold:g}.')
        if self.action_budget < 1:
            raise ValueError(f'Expected at least 1 action, got {self.action_budget}.')
        if not 0 <= self.concentration < math.inf:
            raise ValueError(f'Expected 0 pseudo-counts or more, got {self.concentration:g}.')

    @property
    def has_prior(self) -> bool:
        """Whether rows without trials are estimated by a prior."""
        return self.shared_prior or self.concentration > 0


def can_infer(model: RobotModel, settings: ImitationSettings, name: str) -> bool:
    """Whether the model says anything of an object: by its trials, or by a prior alone."""
    return name in model.objects or (settings.has_prior and name in settings.world.objects)


def model_gaps(model: RobotModel, settings: ImitationSettings) -> list[str]:
    """Sentences on objects that either the model or the world lacks."""
    untried = [name for name in settings.world.objects if name not in model.objects]
    gaps = []
    if untried:
        gaps.append(sentences.untried(untried, model.label, settings.has_prior))
    if model.left_out:
        gaps.append(sentences.left_out(model.left_out, model.label, settings.world.name))
    return gaps


def believe(model: RobotModel, settings: ImitationSettings, demo: Demonstration) -> GoalBelief:
    """Infer the goal of a demonstration by the robot's own model ("like me").

    Raises:
        ValueError: an object without trials, and no prior.
    """
    soft = settings.soft_evidence
    x_i, x_f = (
        np.asarray(probability, dtype=np.float64) if soft and probability else state
        for probability, state in (
            (demo.x_i_probability, demo.x_i),
            (demo.x_f_probability, demo.x_f),
        )
    )
    posterior = _goal_model(model, settings, demo.object).goal_posterior(x_i, x_f)
    goal = settings.world.states[map_goal(posterior, demo.x_f)]
    return GoalBelief(
        stamp=demo.stamp,
        frame=demo.frame,
        object=demo.object,
        x_i=demo.x_i,
        x_f=demo.x_f,
        prior=settings.goal_prior,
        posterior=tuple(posterior.tolist()),
        goal=goal,
        model=model.label,
        sentence=sentences.belief(settings.world, demo, posterior.tolist(), goal),
    )


def decide(
    model: RobotModel,
    settings: ImitationSettings,
    demo: Demonstration,
    view: TableSnapshot,
    number: int,
    actions_spent: int = 0,
) -> Decision:
    """Decide on a demonstration, given the current table state.

    actions_spent: by earlier decisions on the same demonstration (sequential mode).

    Raises:
        ValueError: an object without trials, and no prior.
    """
    belief = believe(model, settings, demo)
    x_i, goal, mode, tau = view.states[demo.object], belief.goal, settings.mode, settings.threshold
    left = max(0, settings.action_budget - actions_spent)
    known = _goal_model(model, settings, demo.object)
    world = settings.world
    copied = world.action_of(demo.manner, demo.x_f)
    choice = choose(known, x_i, goal, copied, mode, tau, left)
    action = None if choice.action is None else world.actions[choice.action]
    return Decision(
        stamp=view.stamp,
        frame=view.frame,
        id=number,
        demonstration=demo.stamp,
        mode=mode,
        object=demo.object,
        x_i=x_i,
        goal=goal,
        goal_posterior=belief.posterior,
        **choice._replace(action=action)._asdict(),
        threshold=tau,
        policy=settings.policy,
        model=model.label,
        sentence=sentences.decision(world, choice, demo.object, x_i, goal, mode, tau),
    )


def no_trials(
    model: RobotModel, settings: ImitationSettings, demo: Demonstration, number: int
) -> Decision:
    """Decide on the demonstration of an object of which `can_infer` is false: no action.

    Its goal is the state that was shown, its goal posterior the prior.
    """
    none = (0.0,) * len(settings.world.actions)
    return Decision(
        stamp=demo.stamp,
        frame=demo.frame,
        id=number,
        demonstration=demo.stamp,
        mode=settings.mode,
        object=demo.object,
        x_i=demo.x_f,
        goal=demo.x_f,
        goal_posterior=settings.goal_prior,
        kind=Kind.NO_ACTION,
        action=None,
        action_probability=none,
        success_probability=none,
        predicted=(),
        predicted_success=math.nan,
        actions_left=0,
        plan_success=none,
        plan_value=0.0,
        threshold=settings.threshold,
        policy=settings.policy,
        model=model.label,
        sentence=sentences.no_trials(demo, model.label),
    )


def _goal_model(model: RobotModel, settings: ImitationSettings, name: str) -> GoalModel:
    return model.goal_model(
        name, settings.goal_prior, settings.policy, settings.concentration, settings.shared_prior
    )


def help_request(asking: Decision) -> HelpRequest:
    """The help request of a decision to ask."""
    assert asking.action is not None, 'A decision to ask names the best action.'
    return HelpRequest(
        stamp=asking.stamp,
        frame=asking.frame,
        id=asking.id,
        object=asking.object,
        x_i=asking.x_i,
        goal=asking.goal,
        action=asking.action,
        predicted_success=asking.predicted_success,
        threshold=asking.threshold,
        question=sentences.question(
            asking.object, asking.x_i, asking.goal, asking.action, asking.predicted_success
        ),
    )

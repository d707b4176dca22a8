"""Goal-based imitation: demonstration -> belief -> decision -> help request (Methods)."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, NamedTuple

import numpy as np

from likeme_core.observations import Demonstration, TableSnapshot
from likeme_core.tabletop import Mode, State
from likeme_core.world import World, load_world
from likeme_inference.tabletop import sentences
from likeme_inference.tabletop.action_selection import Choice, Kind, choose
from likeme_inference.tabletop.asking import (
    ASKING_MODES,
    Asking,
    choose_least_cost,
    choose_to_keep,
    expected_successes,
)
from likeme_inference.tabletop.cost_planning import CostChoice, Costs, Question
from likeme_inference.tabletop.dirichlet import credible_interval
from likeme_inference.tabletop.domain import Policy
from likeme_inference.tabletop.goal_inference import map_goal
from likeme_inference.tabletop.goal_model import GoalModel
from likeme_inference.tabletop.intended_success import meant
from likeme_inference.tabletop.prior import Prior
from likeme_inference.tabletop.promise import Promise, promise
from likeme_inference.tabletop.robot_model import RobotModel
from likeme_inference.tabletop.values import (
    BlockedAction,
    Decision,
    ExpectedCosts,
    GoalBelief,
    HelpRequest,
    RequestKind,
    Support,
)


class Goals(StrEnum):
    """Of what the goals are that are imitated."""

    #: The paper: each demonstration has the goal of its object.
    OBJECT = 'object'
    #: One goal for all objects, see joint_goals.py, imitated once the person has stopped.
    JOINT = 'joint'


@dataclass(frozen=True)
class ImitationSettings:
    """Settings of a decision.

    Attributes:
        threshold: predicted success (sequential: value of the best plan) below which it asks.
        asking: what decides whether the interactive and the sequential mode ask.
        costs: of asking by cost.
        promise: share of episodes in which the goal shall be reached, help counting, of asking
            to keep a promise; `threshold` is then what the session has found for it.
        action_budget: actions per demonstration in sequential mode.
        policy: variant of P(A | G, X_i).
        concentration: Dirichlet pseudo-count of every final state with Prior.OWN; 0: maximum
            likelihood, as in the paper.
        prior: whether a prior fitted to the trials of all objects is used instead.
        soft_evidence: whether perception's probabilities of x_i and x_f are used, or their modes.
        world: its states and actions.
        goal_prior: P(G), indexed by the states; sums to 1. Empty: uniform.
        turn_timeout: s of stamps in which the object must be put back after a demonstration.
        turn_delay: s of stamps for which the object must be settled off the goal before the robot
            decides, so that a demonstration that is still being processed arrives first; 0 once
            the object was observed being put back.
        outcome_timeout: s of stamps in which a settled table state must follow the motion.
        goals: whether each demonstration has a goal of its own, or a joint goal is imitated once
            the person has stopped.
    """

    world: World = field(default_factory=load_world)
    mode: Mode = Mode.INTERACTIVE
    threshold: float = 0.5
    asking: Asking = Asking.THRESHOLD
    costs: Costs = field(default_factory=Costs)
    promise: float = 0.9
    action_budget: int = 3
    policy: Policy = Policy.DIRECT
    concentration: float = 0.0
    prior: Prior = Prior.OWN
    soft_evidence: bool = True
    goal_prior: tuple[float, ...] = ()
    turn_timeout: float = 60.0
    turn_delay: float = 0.5
    outcome_timeout: float = 10.0
    goals: Goals = Goals.OBJECT

    def __post_init__(self) -> None:
        object.__setattr__(self, 'mode', Mode(self.mode))
        object.__setattr__(self, 'policy', Policy(self.policy))
        object.__setattr__(self, 'goals', Goals(self.goals))
        object.__setattr__(self, 'prior', Prior(self.prior))
        object.__setattr__(self, 'asking', Asking(self.asking))
        object.__setattr__(self, 'costs', Costs(*self.costs).checked())
        count = len(self.world.states)
        object.__setattr__(self, 'goal_prior', tuple(self.goal_prior) or (1 / count,) * count)
        if len(self.goal_prior) != count or not all(p >= 0 for p in self.goal_prior):
            raise ValueError(
                f'Expected {count} probabilities of 0 or more, got {list(self.goal_prior)}.'
            )
        if not math.isclose(sum(self.goal_prior), 1.0, abs_tol=1e-6):
            raise ValueError(f'Expected probabilities to sum to 1, got {sum(self.goal_prior):g}.')
        if self.goals is Goals.JOINT and self.mode is Mode.TRAJECTORY:
            raise ValueError('Expected a mode that infers goals with joint goals, got trajectory.')
        if not 0 <= self.threshold <= 1:
            raise ValueError(f'Expected a threshold from 0 to 1, got {self.threshold:g}.')
        if not 0 <= self.promise <= 1:
            raise ValueError(f'Expected a promise from 0 to 1, got {self.promise:g}.')
        if self.action_budget < 1:
            raise ValueError(f'Expected at least 1 action, got {self.action_budget}.')
        if not 0 <= self.concentration < math.inf:
            raise ValueError(f'Expected 0 pseudo-counts or more, got {self.concentration:g}.')

    @property
    def has_prior(self) -> bool:
        """Whether rows without trials are estimated by a prior."""
        return self.prior is not Prior.OWN or self.concentration > 0


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


def believe(
    model: RobotModel,
    settings: ImitationSettings,
    demo: Demonstration,
    given: tuple[float, ...] = (),
) -> GoalBelief:
    """Infer the goal of a demonstration by the robot's own model ("like me").

    given: P(G) where it does not follow from this demonstration: an operator has named the goal,
        or it is that of a joint goal.

    Raises:
        ValueError: an object without trials, and no prior.
    """
    if not given:
        x_i, x_f = _seen(settings, demo)
        posterior = _goal_model(model, settings, demo.object).goal_posterior(x_i, x_f)
        goal = settings.world.states[map_goal(posterior, demo.x_f)]
        sentence = sentences.belief(settings.world, demo, posterior.tolist(), goal)
    else:
        posterior = np.asarray(given)
        goal = settings.world.states[map_goal(posterior, demo.x_f)]
        sentence = sentences.goal_given(demo.object, goal, given[goal])
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
        sentence=sentence,
    )


def meant_by(
    model: RobotModel,
    settings: ImitationSettings,
    demo: Demonstration,
    given: tuple[float, ...] = (),
) -> tuple[float, ...]:
    """P(G) of what was meant, by a person who acts as the robot would (intended_success.py).

    Args and errors: see `believe`.
    """
    if given:
        return given
    known = _goal_model(model, settings, demo.object)
    return tuple(meant(known, *_seen(settings, demo)).sum(axis=0).tolist())


def _seen(settings: ImitationSettings, demo: Demonstration) -> tuple[Any, Any]:
    """Evidence on x_i and x_f."""
    soft = settings.soft_evidence
    return (
        np.array(demo.x_i_probability, float) if soft and demo.x_i_probability else demo.x_i,
        np.array(demo.x_f_probability, float) if soft and demo.x_f_probability else demo.x_f,
    )


def decide(
    model: RobotModel,
    settings: ImitationSettings,
    demo: Demonstration,
    view: TableSnapshot,
    number: int,
    actions_spent: int = 0,
    blocked: tuple[BlockedAction, ...] = (),
    given: tuple[float, ...] = (),
) -> Decision:
    """Decide on a demonstration, given the current table state.

    actions_spent: by earlier decisions on the same demonstration (sequential mode).
    blocked: actions that the arm did not begin for it. From the state in which that was they are
        taken to move nothing; if the robot then asks, it asks by the best action, blocked or not.
    given: see `believe`.

    Raises:
        ValueError: an object without trials, and no prior.
    """
    belief = believe(model, settings, demo, given)
    x_i, name = view.states[demo.object], demo.object
    left = max(0, settings.action_budget - actions_spent)
    known, world = _goal_model(model, settings, name), settings.world
    here = tuple(each for each in blocked if each.x_i == x_i and settings.mode in ASKING_MODES)
    actions = {each.action for each in here}
    chosen = _choose(
        known.without(x_i, actions) if here else known, settings, demo, x_i, belief, left, given
    )
    if here and chosen.choice.kind is Kind.ASK_HUMAN:
        whole = _choose(known, settings, demo, x_i, belief, left, given)
        if whole.choice.action is not None and world.actions[whole.choice.action] in actions:
            chosen = whole._replace(choice=whole.choice._replace(kind=Kind.ASK_HUMAN))
    goal, choice, costs = chosen.goal, chosen.choice, chosen.costs
    action = None if choice.action is None else world.actions[choice.action]
    support = _support(model, settings, name, x_i, goal, choice.action)
    sentence = _sentence(settings, name, x_i, chosen, here)
    if support is not None:
        sentence += ' ' + sentences.support(name, support, choice.predicted_success)
    return Decision(
        stamp=view.stamp,
        frame=view.frame,
        id=number,
        demonstration=demo.stamp,
        mode=settings.mode,
        object=name,
        x_i=x_i,
        goal=goal,
        goal_posterior=belief.posterior,
        **choice._replace(action=action)._asdict(),
        threshold=settings.threshold,
        policy=settings.policy,
        model=model.label,
        sentence=sentence,
        support=support,
        costs=None if costs is None or action is None else _expected(costs, belief, goal, world),
        blocked=here or None,
    )


class _Chosen(NamedTuple):
    """A choice; the goal it is for; by cost and by a promise what it follows from."""

    goal: State
    choice: Choice
    costs: CostChoice | None = None
    sure: float = math.nan


def _choose(
    known: GoalModel,
    settings: ImitationSettings,
    demo: Demonstration,
    x_i: State,
    belief: GoalBelief,
    left: int,
    given: tuple[float, ...],
) -> _Chosen:
    """What to do for the goal that is believed, by what the settings ask by."""
    goal, mode, tau, world = belief.goal, settings.mode, settings.threshold, settings.world
    asking = _asking(settings)
    if asking is Asking.COST:
        pursued, choice, costs = choose_least_cost(
            known, x_i, goal, belief.posterior, mode, settings.costs, left
        )
        return _Chosen(world.states[pursued], choice, costs)
    if asking is Asking.PROMISE:
        wanted = np.asarray(given) if given else meant(known, *_seen(settings, demo))
        choice, sure = choose_to_keep(known, x_i, goal, wanted, mode, tau, left)
        return _Chosen(goal, choice, sure=sure)
    copied = world.action_of(demo.manner, demo.x_f)
    return _Chosen(goal, choose(known, x_i, goal, copied, mode, tau, left))


def _asking(settings: ImitationSettings) -> Asking:
    return settings.asking if settings.mode in ASKING_MODES else Asking.THRESHOLD


def _sentence(
    settings: ImitationSettings,
    name: str,
    x_i: State,
    chosen: _Chosen,
    blocked: tuple[BlockedAction, ...],
) -> str:
    world, choice, goal, tau = settings.world, chosen.choice, chosen.goal, settings.threshold
    why = {int(each.action): each.why for each in blocked}
    if choice.kind is Kind.ASK_HUMAN and choice.action in why:
        return sentences.not_free(world, choice, name, x_i, goal, why[choice.action])
    by_threshold = _asking(settings) is Asking.THRESHOLD
    if by_threshold or choice.action is None or choice.plan_value <= 0:
        sentence = sentences.decision(world, choice, name, x_i, goal, settings.mode, tau)
    elif chosen.costs is not None:
        sentence = sentences.by_cost(world, choice, name, x_i, goal, chosen.costs)
    else:
        target = settings.promise
        sentence = sentences.kept(world, choice, name, x_i, goal, chosen.sure, tau, target)
    return ' '.join((sentence, *(sentences.left_aside(each) for each in blocked)))


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


def first_promise(model: RobotModel, settings: ImitationSettings) -> Promise:
    """The promise of a robot that has imitated nothing yet: by its model of all its objects."""
    predicted = [
        success
        for name in model.objects
        for success in expected_successes(
            _goal_model(model, settings, name), settings.mode, settings.action_budget
        )
    ]
    return promise(predicted or [0.0], settings.promise)


def _goal_model(model: RobotModel, settings: ImitationSettings, name: str) -> GoalModel:
    promises = settings.asking is Asking.PROMISE
    return (model.promising_model if promises else model.goal_model)(
        name, settings.goal_prior, settings.policy, settings.concentration, settings.prior
    )


def _expected(costs: CostChoice, belief: GoalBelief, goal: State, world: World) -> ExpectedCosts:
    other = max((g for g in world.states if g != goal), key=lambda g: belief.posterior[g])
    act = costs.act if costs.act < math.inf else math.nan
    return ExpectedCosts(act, costs.help, costs.which, costs.question, other)


def _support(
    model: RobotModel,
    settings: ImitationSettings,
    name: str,
    x_i: State,
    goal: State,
    action: int | None,
) -> Support | None:
    """What an action's success is known from, if a prior was fitted to other objects' trials."""
    if action is None or settings.prior is Prior.OWN:
        return None
    known = model.counted(name, prior=settings.prior)
    bounds = credible_interval(known)
    return Support(
        trials=int(known.counts[x_i, action].sum()),
        object_trials=known.trials,
        borrowed=model.borrowed(name, x_i, action, settings.prior),
        low=float(bounds.low[x_i, action, goal]),
        high=float(bounds.high[x_i, action, goal]),
    )


def help_request(asking: Decision) -> HelpRequest:
    """The help request of a decision to ask."""
    assert asking.action is not None, 'A decision to ask names the best action.'
    kind = RequestKind.HELP
    refused = [each for each in asking.blocked or () if each.action == asking.action]
    if refused:
        kind = RequestKind.CLEAR_THE_WAY
        question = sentences.clear_the_way(asking.object, asking.goal, refused[0])
    elif asking.costs is not None and asking.costs.question is Question.WHICH:
        kind = RequestKind.WHICH_GOAL
        question = sentences.which(
            asking.object, asking.goal, asking.costs.other, asking.goal_posterior, asking.action
        )
    else:
        question = sentences.question(
            asking.object, asking.x_i, asking.goal, asking.action, asking.predicted_success
        )
    if asking.also:
        question += ' ' + sentences.likewise(asking.also)
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
        question=question,
        kind=kind,
    )

"""Sentences for beliefs, decisions, questions and outcomes.

The texts are part of recorded decision logs.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from likeme_core.observations import Demonstration
from likeme_core.outcomes import Actor, MotionOutcome
from likeme_core.tabletop import Action, Mode, State
from likeme_core.world import World
from likeme_inference.tabletop.action_selection import Choice, Kind, asks
from likeme_inference.tabletop.cost_planning import CostChoice, Question
from likeme_inference.tabletop.values import BlockedAction, Decision, Result, Support

NOT_IMITATED = 'not imitated, as no prior is set (concentration or prior)'


def belief(world: World, demo: Demonstration, posterior: Sequence[float], goal: State) -> str:
    """Describe a demonstration and the inferred goal."""
    how = demo.manner.handling.past
    rest = ', '.join(f'{g.name} {posterior[g]:.2f}' for g in world.states if g != goal)
    return (
        f'I saw the {demo.object} being {how} from {demo.x_i.name} to {demo.x_f.name}: '
        f'it is wanted {goal.name} (p = {posterior[goal]:.2f}; {rest}).'
    )


def goal_given(name: str, goal: State, probability: float) -> str:
    """Describe a goal that was not inferred from one demonstration of the object."""
    if probability == 1:
        return f'I was told that the {name} is wanted {goal.name}.'
    return f'The {name} is wanted {goal.name} with p = {probability:.2f}.'


def likewise(also: Sequence[tuple[str, State]]) -> str:
    """Say what else would be asked for."""
    wanted = _listed([f'the {name} {goal.name}' for name, goal in also])
    return f'I would ask likewise for {wanted}: please do that, too.'


def decision(
    world: World,
    choice: Choice,
    name: str,
    x_i: State,
    goal: State,
    mode: Mode,
    threshold: float,
) -> str:
    """Describe a choice and its reason."""
    if choice.kind is Kind.AT_GOAL:
        return f'The {name} is {goal.name} already, where it is wanted: nothing to do.'
    here = f'The {name} is {x_i.name} and wanted {goal.name}'
    if choice.kind is Kind.NO_ACTION or choice.action is None:
        return f'{here}, but I know no action that takes it there: I leave it.'
    best = world.actions[choice.action].name
    works = f'works with p = {choice.predicted_success:.2f}'
    if mode is Mode.SEQUENTIAL:
        return _planned(here, best, works, choice, threshold)
    if choice.kind is Kind.ASK_HUMAN:
        if not asks(choice.predicted_success, threshold):
            return f'{here}, and I know no action that takes it there: I ask.'
        return f'{here}; my best action, {best}, {works}, below {_exact(threshold)}: I ask.'
    if mode is Mode.TRAJECTORY:
        return f'{here}: I copy what I saw, {best}, which {works}.'
    return f'{here}: my best action is {best}, which {works}.'


def kept(
    world: World,
    choice: Choice,
    name: str,
    x_i: State,
    goal: State,
    sure: float,
    threshold: float,
    target: float,
) -> str:
    """Describe a choice that keeps a promise, and its reason."""
    assert choice.action is not None, 'What is done or asked for names an action.'
    asked = choice.kind is Kind.ASK_HUMAN
    bound = f'{"below" if asked else "at least"} {threshold:.2f}, to keep {target:.0%}'
    best, then = world.actions[choice.action].name, 'I ask' if asked else 'I try'
    return (
        f'The {name} is {x_i.name} and wanted {goal.name}; {best} takes it where it was meant '
        f'with p = {sure:.2f}, {bound}: {then}.'
    )


def by_cost(
    world: World, choice: Choice, name: str, x_i: State, goal: State, costs: CostChoice
) -> str:
    """Describe a choice of least expected cost."""
    assert choice.action is not None, 'What is done or asked for names an action.'
    doing = {
        None: f'I do {world.actions[choice.action].name}',
        Question.HELP: 'I ask for help',
        Question.WHICH: 'I ask where',
    }[costs.question]
    act = f'{costs.act:.2f}' if costs.act < math.inf else 'more'
    return (
        f'The {name} is {x_i.name} and wanted {goal.name}; acting is expected to cost {act}, help '
        f'{costs.help:.2f}, asking where it is wanted {costs.which:.2f}: {doing}.'
    )


def not_free(world: World, choice: Choice, name: str, x_i: State, goal: State, why: str) -> str:
    """Describe why the robot asks after an action that was not free."""
    assert choice.action is not None, 'What is asked for names an action.'
    return (
        f'The {name} is {x_i.name} and wanted {goal.name}; {world.actions[choice.action].name}, '
        f'which works with p = {choice.predicted_success:.2f}, is not free: I ask. {why}'
    )


def left_aside(blocked: BlockedAction) -> str:
    """Say that an action was not considered, and why."""
    return f'{blocked.action.name} is not free: {blocked.why}'


def support(name: str, known: Support, predicted: float) -> str:
    """Describe what a predicted success is known from."""
    lenders = [lender for lender, _ in known.borrowed if lender != name]
    lent = sum(worth for lender, worth in known.borrowed if lender != name)
    source = f'from {_listed(lenders)} ' if lenders else ''
    expected = f'I expect {predicted:.2f} ({known.low:.2f} to {known.high:.2f})'
    if not known.object_trials:
        return f'I never tried the {name}; {source}{expected}.'
    if not known.trials:
        return f'I never tried that with the {name} there; {source}{expected}.'
    return (
        f'I tried that {known.trials} time{"s" * (known.trials > 1)} with the {name}, and borrow '
        f'what is worth {lent:.1f} trials {source}: {expected}.'.replace(' :', ':')
    )


def no_trials(demo: Demonstration, model: str) -> str:
    """Say that nothing follows from the demonstration of an object without trials."""
    return (
        f'I saw the {demo.object} being {demo.manner.handling.past} from {demo.x_i.name} to '
        f'{demo.x_f.name}, but {model} has no trials of it: {NOT_IMITATED}.'
    )


def untried(names: Sequence[str], model: str, has_prior: bool) -> str:
    """Say of which objects a model has no trials, and what that means."""
    what = 'inferred by the prior alone' if has_prior else NOT_IMITATED
    return f'{model} has no trials of {", ".join(names)}: {what}.'


def left_out(names: Sequence[str], model: str, world: str) -> str:
    """Say which objects of a model a world lacks."""
    return f'{model} has trials of {", ".join(names)}, which the world {world} lacks: not used.'


def _planned(here: str, best: str, works: str, choice: Choice, threshold: float) -> str:
    """Describe a choice in sequential mode."""
    left = choice.actions_left
    if left == 0:
        return f'{here}, and my actions are spent: I ask.'
    with_all = f'with {left} action{"s" * (left > 1)} I get there with p = {choice.plan_value:.2f}'
    if choice.kind is Kind.ASK_HUMAN:
        if not asks(choice.plan_value, threshold):
            return f'{here}, and I know no action that takes it there: I ask.'
        return f'{here}; {with_all}, below {_exact(threshold)}: I ask.'
    return f'{here}: I begin with {best}, which {works}; {with_all}.'


def _exact(threshold: float) -> str:
    rounded = f'{threshold:.2f}'
    return rounded if float(rounded) == threshold else f'{threshold:g}'


def which(name: str, goal: State, other: State, posterior: Sequence[float], action: Action) -> str:
    """The question of a help request that asks which goal was meant."""
    return (
        f'Did you mean {goal.name} ({posterior[goal]:.2f}) or {other.name} '
        f'({posterior[other]:.2f}) with the {name}? Name the goal, have me try {action.name} for '
        f'{goal.name}, do it by hand, or skip it.'
    )


def clear_the_way(name: str, goal: State, refused: BlockedAction) -> str:
    """The question of a help request after an action that was not free."""
    return (
        f'I want the {name} to be {goal.name}. {refused.why} Will you clear the way and have me '
        f'try {refused.action.name}, do it by hand, or shall we skip it?'
    )


def _listed(names: Sequence[str]) -> str:
    *first, last = names
    return f'{", ".join(first)} and {last}' if first else last


def question(name: str, x_i: State, goal: State, action: Action, predicted: float) -> str:
    """The question of a help request."""
    if predicted == 0:
        return (
            f'I want the {name} to be {goal.name}, but from {x_i.name} I know no way there. '
            'Will you do it by hand, or shall we skip it?'
        )
    return (
        f'I want the {name} to go from {x_i.name} to {goal.name}, but my best action, '
        f'{action.name}, works with p = {predicted:.2f} only. '
        'Will you do it by hand, shall I try anyway, or shall we skip it?'
    )


def outcome(
    decision: Decision,
    result: Result,
    actor: Actor,
    x_f: State | None,
    motion: MotionOutcome | None,
) -> str:
    """Describe the outcome as observed by the camera."""
    name, goal = decision.object, decision.goal.name
    if result is Result.SKIPPED:
        return f'The {name} stays where it is: the operator skipped my question.'
    if result is Result.GOAL_NAMED:
        return f'The operator named the goal of the {name}: I decide anew.'
    if result is Result.NOT_SEEN or x_f is None:
        return f'I wanted the {name} {goal}, but did not see in time where it ended up.'
    who = 'hand' if actor is Actor.HUMAN or decision.action is None else decision.action.name
    how = f' (the motion ended {motion.name})' if motion else ''
    if result is Result.REACHED:
        return f'The {name} is {goal} now: reached by {who}{how}.'
    if motion is MotionOutcome.HELD:
        return f'The {name} is {x_f.name}, not {goal}: {who} was stopped on its way.'
    return f'The {name} is {x_f.name}, not {goal}: missed by {who}{how}.'


def not_begun(name: str, action: Action, message: str) -> str:
    """Describe a motion that was not begun, as its place or way was not free."""
    return f'{action.name} of the {name} was not begun: {message} Nothing moved; I decide anew.'


def arm_failed(name: str, action: Action, message: str) -> str:
    """Describe a motion that failed."""
    return f'{action.name} of the {name} failed: {message} I will not repeat it.'

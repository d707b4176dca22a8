"""Sentences of the demo: what the robot saw, inferred and did, with the numbers.

Functions of the fields of the LikeMe messages, without ROS imports.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from likeme_bringup.demo_acts import DemoAct, DemoActResult
from likeme_core.tabletop import Manner
from likeme_core.world import World
from likeme_core.world.values import UNKNOWN

#: Captions by likeme_msgs/Outcome.result.
RESULT_CAPTIONS = (
    'goal reached',
    'goal missed',
    'not seen',
    'arm failed',
    'skipped',
    'goal named',
)


def state_name(world: World, state: int) -> str:
    """The name of a state, or UNKNOWN."""
    known = world.state_at(state)
    return UNKNOWN if known is None else known.name


def distribution(world: World, probabilities: Sequence[float]) -> str:
    """Names and probabilities of the states, most probable first."""
    ranked = sorted(range(len(probabilities)), key=lambda state: (-probabilities[state], state))
    return ', '.join(f'{world.states[state].name} {probabilities[state]:.2f}' for state in ranked)


def table(world: World, table_state: Any) -> str:
    """What the camera sees, from a TableState."""
    places = ', '.join(f'{o.name} {state_name(world, o.state)}' for o in table_state.objects)
    return f'The camera sees: {places}.'


def demonstration(world: World, demo: Any) -> str:
    """What perception reported of the person's act, from a Demonstration."""
    manner = Manner(demo.manner).handling.past
    seconds = (demo.end.sec - demo.start.sec) + (demo.end.nanosec - demo.start.nanosec) * 1e-9
    return (
        f'A hand came, the {demo.object} went from {state_name(world, demo.x_i)} to'
        f' {state_name(world, demo.x_f)}, and the hand left, all in {seconds:.1f} s. It was'
        f' {manner} (p = {demo.manner_probability:.2f}): it rose {demo.rise * 100:.0f} cm.'
    )


def belief(world: World, goal_belief: Any) -> str:
    """The inferred goal, from a GoalBelief."""
    return (
        f'So the person probably wants the {goal_belief.object}'
        f' {state_name(world, goal_belief.goal)}:'
        f' P(G | x_i, x_f) = {distribution(world, goal_belief.posterior)}.'
    )


def decision(world: World, choice: Any, shown: DemoAct) -> str:
    """The chosen action and its probabilities, from a Decision."""
    action = world.action_at(choice.action)
    if action is None:
        return str(choice.sentence)
    same = action == shown.action
    way = 'the same way as the person' if same else "its own way, not the person's"
    considered = sorted(world.actions, key=lambda a: -choice.action_probability[a])[:3]
    ranking = ', '.join(f'{a.name} {choice.action_probability[a]:.2f}' for a in considered)
    relation = 'at least' if choice.predicted_success >= choice.threshold else 'below'
    return (
        f'Its best action is {action.name} ({way}): P(A | x_i, g) = {ranking}, ...'
        f' That reaches {state_name(world, choice.goal)} with predicted probability'
        f' {choice.predicted_success:.2f}, {relation} the threshold {choice.threshold:.2f}.'
    )


def action_caption(world: World, choice: Any) -> str:
    """Caption of the robot's action, from a Decision; empty if there is none."""
    action = world.action_at(choice.action)
    return '' if action is None else f'robot: {action.name}'


def summary(results: Sequence[DemoActResult], planned: int, seconds: float) -> str:
    """The closing lines."""
    done = sum(result.reached for result in results)
    lines = [f'{done} of {planned} acts reached the goal that was shown, in {seconds:.0f} s.']
    lines += [
        f'  {"reached" if r.reached else "not reached"}: {r.act.title()}.'
        f' {"The robot asked for help. " if r.asked else ""}{r.message}'
        for r in results
    ]
    return '\n'.join(lines)

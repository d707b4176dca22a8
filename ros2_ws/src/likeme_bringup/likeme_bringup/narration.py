"""Sentences of the demo: what the robot saw, inferred and did, with the numbers.

Functions of the fields of the LikeMe messages, without ROS imports.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from likeme_bringup.demo_acts import DemoAct, DemoActResult
from likeme_core.tabletop import Action, Manner, State

#: Captions by likeme_msgs/Outcome.result.
RESULT_CAPTIONS = ('goal reached', 'goal missed', 'not seen', 'arm failed', 'skipped')


def state_name(state: int) -> str:
    """LEFT, RIGHT, OFFTABLE or UNKNOWN."""
    return State(state).name if state in tuple(State) else 'UNKNOWN'


def distribution(probabilities: Sequence[float]) -> str:
    """p over states, most probable first, e.g. 'LEFT 0.97, RIGHT 0.03, OFFTABLE 0.00'."""
    ranked = sorted(range(len(probabilities)), key=lambda state: (-probabilities[state], state))
    return ', '.join(f'{State(state).name} {probabilities[state]:.2f}' for state in ranked)


def table(table_state: Any) -> str:
    """What the camera sees, from a TableState."""
    places = ', '.join(f'{o.name} {state_name(o.state)}' for o in table_state.objects)
    return f'The camera sees: {places}.'


def demonstration(demo: Any) -> str:
    """What perception reported of the person's act, from a Demonstration."""
    manner = 'pushed' if demo.manner == Manner.PUSH else 'placed'
    seconds = (demo.end.sec - demo.start.sec) + (demo.end.nanosec - demo.start.nanosec) * 1e-9
    return (
        f'A hand came, the {demo.object} went from {state_name(demo.x_i)} to'
        f' {state_name(demo.x_f)}, and the hand left, all in {seconds:.1f} s. It was {manner}'
        f' (p = {demo.manner_probability:.2f}): it rose {demo.rise * 100:.0f} cm.'
    )


def belief(goal_belief: Any) -> str:
    """The inferred goal, from a GoalBelief."""
    return (
        f'So the person probably wants the {goal_belief.object} {state_name(goal_belief.goal)}:'
        f' P(G | x_i, x_f) = {distribution(goal_belief.posterior)}.'
    )


def decision(choice: Any, shown: DemoAct) -> str:
    """The chosen action and its probabilities, from a Decision."""
    if choice.action not in tuple(Action):
        return str(choice.sentence)
    action = Action(choice.action)
    same = action == shown.action
    way = 'the same way as the person' if same else "its own way, not the person's"
    considered = sorted(Action, key=lambda a: -choice.action_probability[a])[:3]
    ranking = ', '.join(f'{a.name} {choice.action_probability[a]:.2f}' for a in considered)
    relation = 'at least' if choice.predicted_success >= choice.threshold else 'below'
    return (
        f'Its best action is {action.name} ({way}): P(A | x_i, g) = {ranking}, ...'
        f' That reaches {state_name(choice.goal)} with predicted probability'
        f' {choice.predicted_success:.2f}, {relation} the threshold {choice.threshold:.2f}.'
    )


def action_caption(choice: Any) -> str:
    """Caption of the robot's action, from a Decision; empty if there is none."""
    return f'robot: {Action(choice.action).name}' if choice.action in tuple(Action) else ''


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

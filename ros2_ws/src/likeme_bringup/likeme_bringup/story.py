"""The words of the demo: what happened, as a person would tell it, with the numbers.

Pure functions over the fields of the LikeMe messages; nothing here knows ROS.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from likeme_core.tabletop import Action, State

UNKNOWN = 3
"""likeme_msgs/ObjectState.UNKNOWN: covered, so no state of the model."""


RESULTS = ('goal reached', 'goal missed', 'not seen', 'arm failed', 'skipped')
"""Captions by likeme_msgs/Outcome.result."""


@dataclass(frozen=True)
class Act:
    """One thing for the person to show: take `object` from `start` to `end`."""

    object: str
    start: State
    end: State
    push: bool = False

    @property
    def action(self) -> Action:
        """The demonstrator's action."""
        return Action(int(self.end) + (3 if self.push else 0))

    @property
    def undo(self) -> Action:
        """The action by which the person puts the object back."""
        return Action(int(self.start))

    def title(self) -> str:
        """E.g. 'chicken, RIGHT to LEFT, by placing it'."""
        manner = 'pushing' if self.push else 'placing'
        return f'{self.object}, {self.start.name} to {self.end.name}, by {manner} it'


@dataclass(frozen=True)
class Ending:
    """How one act ended: whether the goal was reached by whom, and the sentence that says so."""

    act: Act
    reached: bool
    asked: bool
    sentence: str


PAPERS_STORY: tuple[Act, ...] = (
    Act('chicken', State.RIGHT, State.LEFT),
    Act('pear', State.RIGHT, State.LEFT),
)
"""The robot is sure of the first (predicts 0.9) and asks for help with the second (0.4)."""


def state_name(state: int) -> str:
    """LEFT, RIGHT, OFFTABLE or UNKNOWN."""
    return 'UNKNOWN' if state == UNKNOWN else State(state).name


def distribution(probabilities: Sequence[float]) -> str:
    """p over states, most probable first, e.g. 'LEFT 0.97, RIGHT 0.03, OFFTABLE 0.00'."""
    ranked = sorted(range(len(probabilities)), key=lambda state: (-probabilities[state], state))
    return ', '.join(f'{State(state).name} {probabilities[state]:.2f}' for state in ranked)


def table(table_state: Any) -> str:
    """One line on what the camera sees, from a TableState."""
    places = ', '.join(f'{o.name} {state_name(o.state)}' for o in table_state.objects)
    return f'The camera sees: {places}.'


def demonstration(demo: Any) -> str:
    """What perception made of the person's act, from a Demonstration."""
    manner = 'pushed' if demo.manner else 'placed'
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


def decision(choice: Any, shown: Act) -> str:
    """What the robot chose and by which numbers, from a Decision."""
    if choice.action == 255:
        return str(choice.sentence)
    action = Action(choice.action)
    same = action == shown.action
    way = 'the same way as the person' if same else "its own way, not the person's"
    considered = sorted(Action, key=lambda a: -choice.action_probability[a])[:3]
    ranking = ', '.join(f'{a.name} {choice.action_probability[a]:.2f}' for a in considered)
    verdict = 'at least' if choice.predicted_success >= choice.threshold else 'below'
    return (
        f'Its best action is {action.name} ({way}): P(A | x_i, g) = {ranking}, ...'
        f' That reaches {state_name(choice.goal)} with predicted probability'
        f' {choice.predicted_success:.2f}, {verdict} the threshold {choice.threshold:.2f}.'
    )


def acting(choice: Any) -> str:
    """Caption of the robot's own act, from a Decision."""
    return '' if choice.action == 255 else f'robot: {Action(choice.action).name}'


def summary(endings: Sequence[Ending], planned: int, seconds: float) -> str:
    """The closing lines."""
    done = sum(ending.reached for ending in endings)
    lines = [f'{done} of {planned} acts reached the goal that was shown, in {seconds:.0f} s.']
    lines += [
        f'  {"reached" if e.reached else "not reached"}: {e.act.title()}.'
        f' {"The robot asked for help. " if e.asked else ""}{e.sentence}'
        for e in endings
    ]
    return '\n'.join(lines)

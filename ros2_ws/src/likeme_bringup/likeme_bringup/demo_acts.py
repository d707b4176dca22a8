"""The acts of the demo, and their results."""

from __future__ import annotations

from dataclasses import dataclass

from likeme_core.tabletop import Action, Manner, State
from likeme_core.world import World


@dataclass(frozen=True)
class DemoAct:
    """One demonstration: the person moves `object` from `start` to `end`.

    Attributes:
        action: by which the person does it.
        undo: by which the person puts the object back.
    """

    object: str
    start: State
    end: State
    action: Action
    undo: Action

    def title(self) -> str:
        """The object, its change of state, and how the person makes it."""
        by = self.action.manner.handling.doing
        return f'{self.object}, {self.start.name} to {self.end.name}, by {by} it'


@dataclass(frozen=True)
class DemoActResult:
    """How one act ended.

    Attributes:
        reached: whether the object ended at the goal that was shown.
        asked: whether the robot asked for help.
        message: the outcome in one sentence.
    """

    act: DemoAct
    reached: bool
    asked: bool
    message: str


def demo_act(world: World, name: str, start: State, end: State, manner: Manner) -> DemoAct:
    """An act of a world.

    Raises:
        ValueError: no such object, no change from a region within reach, or no such action.
    """
    world.object(name)
    if start == end or start in world.out_of_reach:
        raise ValueError(
            'Expected a change that starts where the robot can reach, '
            f'got {start.name} to {end.name}.'
        )
    action = world.action_of(manner, end)
    if action is None:
        raise ValueError(
            f'Expected an action of {world.name}, got none that moves by '
            f'{manner.name.lower()} to {end.name}.'
        )
    return DemoAct(name, start, end, action, world.action_to(start))


def story_acts(world: World) -> tuple[DemoAct, ...]:
    """The story of the world file.

    Raises:
        ValueError: it has none.
    """
    if not world.story:
        raise ValueError(
            f'Expected a story in the world {world.name}, got none: name an act by --object '
            'and --show.'
        )
    return tuple(demo_act(world, *step) for step in world.story)

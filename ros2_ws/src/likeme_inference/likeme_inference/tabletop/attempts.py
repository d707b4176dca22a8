"""Events of a demonstration: what a person did to an object, finished or under way."""

from __future__ import annotations

from dataclasses import dataclass

from numpy.typing import ArrayLike

from likeme_core.tabletop import Manner
from likeme_core.world import World


@dataclass(frozen=True, eq=False)
class Attempt:
    """An act on one object, also one that ended where it began or has not ended yet.

    Attributes:
        object: its name.
        x_i: the state before the act: its number, or a distribution over states, shape [x];
            None: as last seen.
        x_f: the state after it, which may equal x_i, in the same forms; None: not seen, or the act
            is under way.
        manner: how the object is moved; None: not seen.
        direction: number of the state that the act aims at, in which direction the object is
            moved; None: not seen.
        action: number of the action, instead of manner and direction.
        under_way: whether the act goes on. The next event of the same object replaces this one.
    """

    object: str
    x_i: ArrayLike | None = None
    x_f: ArrayLike | None = None
    manner: Manner | None = None
    direction: int | None = None
    action: int | None = None
    under_way: bool = False

    def actions(self, world: World) -> tuple[int, ...]:
        """Numbers of the actions that it may be, from what was seen of it.

        Raises:
            ValueError: the world has no such action, or an outcome of an act under way is given.
        """
        if self.under_way and self.x_f is not None:
            raise ValueError(f'Expected no x_f of an act under way, got {self.x_f}.')
        found = tuple(
            int(a)
            for a in world.actions
            if self.action in (None, a)
            and self.manner in (None, a.manner)
            and self.direction in (None, a.target)
        )
        if not found:
            raise ValueError(
                f'Expected an act that is an action of {world.name}, got action {self.action}, '
                f'manner {self.manner}, direction {self.direction}.'
            )
        return found


@dataclass(frozen=True)
class Stopped:
    """The person has stopped: the demonstration is over."""


Event = Attempt | Stopped

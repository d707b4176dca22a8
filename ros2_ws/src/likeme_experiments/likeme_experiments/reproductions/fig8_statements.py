"""What the paper says of Fig 8 in words, beside what a model does."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from likeme_core.world import World
from likeme_experiments.evaluation.fig8 import Fig8Column


class Fig8Statements(NamedTuple):
    """Of all demonstrations of all objects.

    Attributes:
        of: how many there are.
        goals: in how many the true goal is the MAP goal (Fig 8a).
        directions: in how many the two most preferred actions are aimed at it (Fig 8b).
        asks: (object, x_i, x_f) for which the robot asks (Fig 8c).
    """

    of: int
    goals: int
    directions: int
    asks: tuple[tuple[str, str, str], ...]

    def words(self) -> tuple[str, str, str]:
        """The three statements as text."""
        asks = ', '.join(f'{name} {x_i}>{x_f}' for name, x_i, x_f in self.asks)
        return (
            f'{self.goals} of {self.of}',
            f'{self.directions} of {self.of}',
            asks or 'never',
        )


STATED = (
    'the MAP goal is the true goal',
    'the two most preferred actions aim at the goal',
    'asks',
)
#: The text on Fig 8. That the robot asks for nothing else follows from Table 1, where asking
#: changes the pear's row alone.
PAPER = Fig8Statements(12, 12, 12, (('pear', 'RIGHT', 'LEFT'),))


def statements_of(cases: Sequence[Fig8Column], world: World) -> Fig8Statements:
    """What the paper says, of a model."""
    return Fig8Statements(
        len(cases),
        sum(case.goal == case.x_f for case in cases),
        sum(_towards(case, world) for case in cases),
        tuple((case.object, case.x_i.name, case.x_f.name) for case in cases if case.asks),
    )


def _towards(case: Fig8Column, world: World) -> bool:
    """Whether the two most preferred actions are aimed at x_f.

    One may be all there is: for the pear from RIGHT to LEFT all others have a posterior of 0.
    """
    posterior = case.action_posterior
    liked = sorted((a for a in world.actions if posterior[a] > 0), key=lambda a: -posterior[a])
    return bool(liked) and all(action.target == case.x_f for action in liked[:2])

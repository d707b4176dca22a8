"""The acts of the demo, and their results."""

from __future__ import annotations

from dataclasses import dataclass

from likeme_core.tabletop import Action, Manner, State


@dataclass(frozen=True)
class DemoAct:
    """One demonstration: the person moves `object` from `start` to `end`."""

    object: str
    start: State
    end: State
    manner: Manner = Manner.PLACE

    @property
    def action(self) -> Action:
        """The person's action."""
        return Action.of(self.manner, self.end)

    @property
    def undo(self) -> Action:
        """The action by which the person puts the object back."""
        return Action.of(Manner.PLACE, self.start)

    def title(self) -> str:
        """E.g. 'chicken, RIGHT to LEFT, by placing it'."""
        manner = 'pushing' if self.manner is Manner.PUSH else 'placing'
        return f'{self.object}, {self.start.name} to {self.end.name}, by {manner} it'


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


#: The robot predicts success of the first with 0.9, and asks for help with the second (0.4).
PAPER_ACTS: tuple[DemoAct, ...] = (
    DemoAct('chicken', State.RIGHT, State.LEFT),
    DemoAct('pear', State.RIGHT, State.LEFT),
)

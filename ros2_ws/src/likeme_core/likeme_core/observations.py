"""What perception tells inference: the states in one frame, and human acts.

Stamps are ROS time in ns; `frame` is the frame_id of the header a stamp came with. Probabilities
are tuples indexed by State.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from likeme_core.tabletop import Action, Manner, State


@dataclass(frozen=True)
class TableSnapshot:
    """What is where in one frame; objects whose state is not known are not in `states`.

    settled: no hand and no arm in view, every object at rest.
    """

    stamp: int
    frame: str
    settled: bool
    states: Mapping[str, State]


@dataclass(frozen=True)
class Demonstration:
    """A human act seen from start to end: the fields of likeme_msgs/Demonstration.

    Attributes:
        stamp: of the frame in which the act was found complete.
        start, end: when the hand came into view, and when it left.
        x_i_probability, x_f_probability: what perception gave every State, each summing to 1;
            empty: x_i and x_f are certain.
        manner_probability: of `manner`, 0.5 to 1.
        rise: greatest height the object gained on its way, m.
    """

    stamp: int
    frame: str
    object: str
    x_i: State
    x_f: State
    manner: Manner
    start: int
    end: int
    x_i_probability: tuple[float, ...] = ()
    x_f_probability: tuple[float, ...] = ()
    manner_probability: float = 1.0
    rise: float = 0.0

    @property
    def action(self) -> Action:
        """The robot action that copies what was seen."""
        return Action.of(self.manner, self.x_f)

    def undoes(self, other: Demonstration) -> bool:
        """Whether this act takes the same object back."""
        return (self.object, self.x_i, self.x_f) == (other.object, other.x_f, other.x_i)

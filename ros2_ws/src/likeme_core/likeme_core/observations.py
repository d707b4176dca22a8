"""What perception passes to inference: the states in one frame, demonstrations, and attempts.

Stamps are ROS time in ns; `frame` is the frame_id of the depth image a stamp came with.
Probabilities are tuples indexed by State.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from likeme_core.tabletop import Manner, State

#: A state that is less probable is not known: the object lies on a border.
LEAST_PROBABILITY = 0.9


def is_known(probability: Sequence[float]) -> bool:
    """Whether one state is probable enough to be taken for the object's; empty: it is certain."""
    return max(probability, default=1.0) >= LEAST_PROBABILITY


@dataclass(frozen=True)
class TableSnapshot:
    """The states in one frame; an object whose state is unknown is not in `states`.

    settled: no hand and no arm in view, and all objects at rest.
    """

    stamp: int
    frame: str
    settled: bool
    states: Mapping[str, State]


@dataclass(frozen=True)
class Demonstration:
    """A human act: the fields of likeme_msgs/Demonstration.

    Attributes:
        stamp: of the frame that completed the act.
        start, end: when the hand entered and when it left.
        x_i_probability, x_f_probability: probability of each State, each summing to 1; empty: x_i
            and x_f are certain.
        manner_probability: of `manner`, up to 1.
        rise: greatest height above its initial position, m.
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

    def undoes(self, other: Demonstration) -> bool:
        """Whether this act moves the same object back."""
        return (self.object, self.x_i, self.x_f) == (other.object, other.x_f, other.x_i)


@dataclass(frozen=True)
class ObservedAttempt:
    """A person's act on one object, under way or ended: the fields of likeme_msgs/Attempt.

    Attributes:
        stamp: of the frame in which it was found to be under way, or to have ended.
        x_f: None while it is under way, and if its end was not seen; may equal x_i.
        manner: None if it cannot be told.
        manner_probability: of `manner`, up to 1; 0 without one.
        direction: the region that the object was moved towards; None if it cannot be told.
        under_way: whether it goes on.
        start: stamp of the first frame in which the object was away from where it lay.
        end: of the last frame of the act; while it is under way, of the newest one.
        x_i_probability, x_f_probability: probability of each State, each summing to 1; empty: x_i
            and x_f are certain, or x_f is None.
    """

    stamp: int
    frame: str
    object: str
    x_i: State
    x_f: State | None
    manner: Manner | None
    manner_probability: float
    direction: State | None
    under_way: bool
    start: int
    end: int
    x_i_probability: tuple[float, ...] = ()
    x_f_probability: tuple[float, ...] = ()

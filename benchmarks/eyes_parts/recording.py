"""What happens in one cell: poses of all bodies 30 times a second, with the truth."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from likeme_arm.motion import ObjectView
from likeme_arm_sim.cell import Cell
from likeme_arm_sim.renderer import RenderBody
from likeme_arm_sim.toys import Toy, toys_of
from likeme_core.outcomes import Actor
from likeme_core.paper_world import (
    LEFT,
    OFFTABLE,
    PLACE_LEFT,
    PLACE_OFFTABLE,
    PLACE_RIGHT,
    PUSH_LEFT,
    PUSH_OFFTABLE,
    PUSH_RIGHT,
    WORLD,
)
from likeme_core.tabletop import Action, Manner, State

#: Moments a second, and s of rest before the first act and after each.
RATE, LEAD, REST = 30, 7.0, 2.0
#: A change of the table as (object, x_i, x_f, manner).
Change = tuple[str, State, State, Manner]


@dataclass(frozen=True)
class Moment:
    """All bodies at one time: poses of the toys by name, the hand's parts, and the truth."""

    toys: dict[str, np.ndarray]
    hand: tuple[RenderBody, ...]
    truth: dict[str, ObjectView]

    def bodies(self, looks_like: dict[str, Toy] | None = None) -> list[RenderBody]:
        """What a camera draws; looks_like: other shapes for some toys, by name."""
        toys = toys_of(WORLD) | (looks_like or {})
        parts = ((self.toys[name], part) for name in self.toys for part in toys[name].parts)
        return [*(RenderBody(part, pose) for pose, part in parts), *self.hand]


@dataclass(frozen=True)
class Act:
    """A change by the person, and its first and last moment."""

    change: Change
    first: int
    last: int


@dataclass
class Recording:
    """Moments and acts of one seed."""

    seed: int
    moments: list[Moment] = field(default_factory=list)
    acts: list[Act] = field(default_factory=list)

    def rested(self, m: int) -> bool:
        """Whether for the last second no hand was there and nothing moved by over 3 mm."""
        last = self.moments[max(m - RATE, 0) : m + 1]
        moved = (
            np.abs(last[-1].toys[name][:3, 3] - last[0].toys[name][:3, 3]).max()
            for name in last[0].toys
        )
        return not any(each.hand for each in last) and max(moved) < 0.003

    def arrived(self, act: Act, m: int) -> bool:
        """Whether the object of an act is within 5 cm of where it comes to rest."""
        now, end = (self.moments[k].toys[act.change[0]][:3, 3] for k in (m, act.last))
        return bool(np.linalg.norm(now - end) < 0.05)


def recorded(seed: int, acts: int) -> Recording:
    """A cell in which a person does some acts."""
    recorder = _Recorder(seed)
    recorder.rest(LEAD)
    rng = np.random.default_rng([seed, 1])
    for k in range(acts):
        recorder.act(*_drawn(recorder.cell, k, rng))
    return recorder.recording


def _drawn(cell: Cell, k: int, rng: np.random.Generator) -> tuple[str, Action]:
    """The next act: mostly to the other side, every fourth off the table, the next back."""
    truth = cell.true_states()
    there = [name for name in WORLD.objects if truth[name].state != OFFTABLE]
    name, push = str(rng.choice(there)), bool(k % 2)
    off = [name for name in WORLD.objects if name not in there]
    if k % 4 == 0 and off:
        return off[0], PLACE_LEFT if rng.random() < 0.5 else PLACE_RIGHT
    if k % 4 == 3 and len(there) > 1:
        return name, PUSH_OFFTABLE if rng.random() < 0.5 else PLACE_OFFTABLE
    if truth[name].state == LEFT:
        return name, PUSH_RIGHT if push else PLACE_RIGHT
    return name, PUSH_LEFT if push else PLACE_LEFT


class _Recorder:
    """A cell, and what was recorded of it."""

    def __init__(self, seed: int) -> None:
        self.cell, self.recording = Cell(WORLD, seed, arm_visible=False), Recording(seed)
        self._due = 0.0

    def rest(self, seconds: float) -> None:
        """Let time pass."""
        self.cell.step(seconds, self._tick)

    def act(self, name: str, action: Action) -> None:
        """Let the person act, and wait until everything rests."""
        first, before = len(self.recording.moments), self.cell.true_states()[name].state
        self.cell.run_action(Actor.HUMAN, name, action, lambda _: None, self._tick)
        self.rest(REST)
        after, last = self.cell.true_states()[name].state, len(self.recording.moments) - 1
        if before is not None and after is not None and before != after:
            manner = Manner.PUSH if action.manner is Manner.PUSH else Manner.PLACE
            self.recording.acts.append(Act((name, before, after, manner), first, last))

    def _tick(self) -> None:
        if self.cell.time < self._due:
            return
        self._due = self.cell.time + 1 / RATE
        moments, hand = self.recording.moments, self.cell.hand
        toys = {name: self.cell.physics_world.toy_pose(name).matrix() for name in WORLD.objects}
        pose = np.eye(4)
        pose[:3, 3] = hand.position
        drawn = () if hand.away else tuple(RenderBody(mesh, pose) for mesh in hand.parts)
        moments.append(Moment(toys, drawn, self.cell.true_states()))

"""Perception under one condition, and what it said against the truth."""

from __future__ import annotations

from dataclasses import dataclass, field, fields

import numpy as np
from numpy.typing import NDArray

from eyes_parts.conditions import Condition, spans
from eyes_parts.recording import RATE, Recording
from eyes_parts.scenes import Seen
from likeme_core.observations import Demonstration
from likeme_core.paper_world import OFFTABLE, WORLD
from likeme_perception.catalogue import world_catalogue
from likeme_perception.config import world_config
from likeme_perception.observation import ObjectObservation, TableObservation
from likeme_perception.pipeline import TabletopPerception
from likeme_perception.rgbd import Intrinsics, RgbdFrame, depth_in_metres

#: A state said with more than this counts as claimed; a centroid further off, m, as wrong.
SURE, MISPLACED = 0.99, 0.010
#: Of the probabilities of claimed states.
BINS = 10


def no_claims() -> NDArray[np.float64]:
    """Rows of BINS: how many states were claimed, the sum of their p, and how many were true."""
    return np.zeros((BINS, 3))


@dataclass
class Score:
    """Counts over frames and objects."""

    frames: int = 0
    claimed: int = 0
    wrong: int = 0
    #: Of objects seen at rest: all, and those said to be somewhere else by over MISPLACED.
    placed: int = 0
    misplaced: int = 0
    resting: int = 0
    usable: int = 0
    expected: int = 0
    found: int = 0
    right: int = 0
    manner: int = 0
    #: Of all states that are not UNKNOWN, see no_claims.
    claims: NDArray[np.float64] = field(default_factory=no_claims)

    def __iadd__(self, other: Score) -> Score:
        for each in fields(self):
            setattr(self, each.name, getattr(self, each.name) + getattr(other, each.name))
        return self


class Watcher:
    """Perception of one recording under one condition."""

    def __init__(self, condition: Condition, recording: Recording) -> None:
        self.condition, self.score = condition, Score()
        self._recording, self._acts = recording, spans(recording)
        self._rng = np.random.default_rng([recording.seed, 4])
        mount = condition.scene.mount(0, recording.seed)
        lens = mount.fx, mount.fy, mount.cx, mount.cy, mount.width, mount.height
        self._perception = TabletopPerception(
            world_config(WORLD), Intrinsics(*lens), world_catalogue(WORLD)
        )
        self._found: list[tuple[int, Demonstration]] = []

    def watch(self, seen: Seen) -> None:
        """Take one frame of the scene, if it comes."""
        k, c = seen.k, self.condition
        if k % c.every or not c.comes(seen.moment, self._acts, self._rng):
            return
        images = c.change(seen.images, seen.moment, self._acts, self._rng)
        depth = depth_in_metres(images.depth_mm)
        frame = RgbdFrame(round((k + 1) / RATE * 1e9), 'camera', images.rgb, depth)
        self.score.frames += 1
        try:
            table = self._perception.process(frame)
        except ValueError:
            return
        if table.learned:
            self._found += [(seen.moment, act) for act in table.demonstrations]
            self._judge(table, seen)
        elif k > 9 * RATE:
            # A background that is still not learned: nothing is usable.
            self.score.resting += len(WORLD.objects) * self._recording.rested(seen.moment)

    def _judge(self, table: TableObservation, seen: Seen) -> None:
        if seen.k < self.condition.scene.judged_from:
            return
        rested = self._recording.rested(seen.moment)
        for said in table.objects:
            self._judge_object(said, seen.moment, rested)

    def _judge_object(self, said: ObjectObservation, moment: int, rested: bool) -> None:
        truth, score = self._recording.moments[moment].truth[said.name], self.score
        hidden = said.name in self.condition.scene.hidden
        state = OFFTABLE if hidden else truth.state
        score.resting += bool(rested)
        score.usable += bool(rested and said.state is not None)
        if said.state is not None:
            p = said.state_probability[said.state]
            score.claimed += bool(p > SURE)
            score.wrong += bool(p > SURE and said.state != state)
            score.claims[min(int(p * BINS), BINS - 1)] += 1, p, said.state == state
        if rested and said.visible and truth.state != OFFTABLE and not hidden:
            off = np.hypot(said.centroid[0] - truth.x, said.centroid[1] - truth.y)
            score.placed += 1
            score.misplaced += bool(off > MISPLACED and said.state is not None)

    def finish(self) -> Score:
        """The score, with the demonstrations matched to the acts."""
        score = self.score
        hidden = self.condition.scene.hidden
        open_acts = [act for act in self._recording.acts if act.change[0] not in hidden]
        if self.condition.scene.judged_from:
            # The camera's pose is wrong for all of them: understanding none is right.
            open_acts = []
        score.expected, score.found = len(open_acts), len(self._found)
        for moment, said in self._found:
            of = (said.object, said.x_i, said.x_f)
            for act in self._recording.acts:
                if (
                    self._recording.arrived(act, moment)
                    and act.first <= moment <= act.last + RATE
                    and act.change[:3] == of
                ):
                    score.right += act.change[0] not in hidden
                    score.manner += said.manner is act.change[3]
                    break
        return score

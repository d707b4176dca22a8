"""A mentor watched from its start pose on: the one place where gaze following keeps a state."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from likeme_gaze.beliefs import Gaussian, checked, independent, known
from likeme_gaze.checks import FloatArray
from likeme_gaze.following import Following, Viewpoints, follow_gaze
from likeme_gaze.frames import Pose2, checked_pose, wrapped
from likeme_gaze.gaze_model import GazeModel
from likeme_gaze.reverse import Evidence
from likeme_gaze.simulation import goal_prior

#: A mentor who stands closer than this (cm) has no direction to be faced in.
NEAREST = 10.0


class Mentor(NamedTuple):
    """Where the mentor stood when it was first seen.

    Attributes:
        frame: its frame in the parent's: at the head, x towards the agent.
        start: x_i, its heading in that frame, rad.
        blindfolded: whether its eyes are covered.
    """

    frame: Pose2
    start: float
    blindfolded: bool


class GazeFollower:
    """Takes a mentor's start pose, then observations, and answers each with a Following.

    All poses are in one parent frame: cm, rad, x forward, y left, counter-clockwise.
    Every refusal is a ValueError and leaves the follower as it was.
    """

    def __init__(
        self,
        model: GazeModel,
        agent: Pose2,
        agent_heading: float = 0.0,
        prior: Gaussian | None = None,
        most_moved: float = 30.0,
    ) -> None:
        """A follower that has seen nothing yet.

        Args:
            model: the trained agent.
            agent: its frame in the parent's: at its head, x where it looks by default.
            agent_heading: where it looks now, in its own frame, rad.
            prior: of the goal in the parent's frame (2,); by default the wide one halfway
                between agent and mentor.
            most_moved: how far (cm) the mentor's head may move from its start place.
        """
        self.model = model
        self.agent = checked_pose("the agent's pose", agent)
        self._head = checked_pose("the agent's head", Pose2(0.0, 0.0, agent_heading)).heading
        self._prior = None if prior is None else checked('the prior', prior, 2)
        self._most_moved = most_moved
        self._mentor: Mentor | None = None
        self._seen: list[FloatArray] = []
        self._last: Following | None = None

    @property
    def mentor(self) -> Mentor | None:
        """The mentor that is being watched."""
        return self._mentor

    @property
    def observations(self) -> int:
        """How many final states of this mentor were seen."""
        return len(self._seen)

    @property
    def following(self) -> Following | None:
        """The answer to the last observation."""
        return self._last

    def start(self, pose: Pose2, blindfolded: bool = False) -> Mentor:
        """Begin with a mentor: `pose` is its head before it moves. Forgets the mentor before.

        Raises:
            ValueError: numbers that are not finite, or a mentor where the agent is.
        """
        head = checked_pose("the mentor's start pose", pose)
        away = math.hypot(head.x - self.agent.x, head.y - self.agent.y)
        if away < NEAREST:
            raise ValueError(
                f'Expected the mentor at least {NEAREST:g} cm from the agent, got {away:.1f} cm.'
            )
        frame = head.facing(self.agent.x, self.agent.y)
        self._mentor = Mentor(frame, float(wrapped(head.heading - frame.heading)), blindfolded)
        self._seen, self._last = [], None
        return self._mentor

    def observe(self, pose: Pose2, distance: float | None = None) -> Following:
        """Take the mentor's head after a movement, and say what it looks at.

        Several observations of one mentor are several executions of one goal, each from the
        start pose.

        Args:
            pose: the head.
            distance: how far away its eyes converge, cm, where that can be seen: for all
                observations of a mentor or for none.

        Raises:
            ValueError: no start pose yet, numbers that are not finite, a mentor who walked away,
                a distance that is not positive or not as before.
        """
        if self._mentor is None:
            raise ValueError('Expected a start pose before the first observation, got none.')
        seen = [*self._seen, self._final_state(self._mentor, pose, distance)]
        evidence = Evidence(len(seen), np.mean(seen, axis=0))
        around = self._last.mentor if self._last is not None else None
        views = Viewpoints(self.agent, self._mentor.frame, known([self._head]))
        heads = self.model.mentor_head(self._mentor.blindfolded), self.model.head
        self._last = follow_gaze(heads, self._belief(self._mentor), evidence, views, around)
        self._seen = seen
        return self._last

    def _belief(self, mentor: Mentor) -> Gaussian:
        """Prior of (goal, x_i) in the mentor's frame."""
        prior = self._prior or goal_prior(self.agent, mentor.frame)
        return independent(mentor.frame.belief_from_parent(prior), known([mentor.start]))

    def _final_state(self, mentor: Mentor, pose: Pose2, distance: float | None) -> FloatArray:
        """x_f in the mentor's frame, (heading,) or (heading, distance)."""
        head = checked_pose("the mentor's pose", pose)
        moved = math.hypot(head.x - mentor.frame.x, head.y - mentor.frame.y)
        if moved > self._most_moved:
            raise ValueError(
                f'Expected the mentor within {self._most_moved:g} cm of its start place, '
                f'got {moved:.1f} cm.'
            )
        turn = float(wrapped(head.heading - mentor.frame.heading - mentor.start))
        state = np.array([mentor.start + turn, *([] if distance is None else [distance])])
        if self._seen and len(state) != len(self._seen[0]):
            wanted = 'a distance' if len(self._seen[0]) == 2 else 'no distance'
            raise ValueError(f'Expected {wanted} as before, got {distance}.')
        if distance is not None and not (math.isfinite(distance) and distance > 0):
            raise ValueError(f'Expected a distance of more than 0 cm, got {distance:g}.')
        return state

"""Stateful gaze following of one mentor, from its start pose on."""

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

#: Least distance of agent and mentor, cm; closer, the direction between them is undefined.
MIN_DISTANCE = 10.0


class Mentor(NamedTuple):
    """The mentor at its start pose.

    Attributes:
        frame: the mentor's frame in the parent frame: origin at the head, x towards the agent.
        start: x_i, the heading in that frame, rad.
        blindfolded: whether its eyes are covered.
    """

    frame: Pose2
    start: float
    blindfolded: bool


class GazeFollower:
    """Takes a mentor's start pose, then observations, and returns a Following for each.

    All poses are in one parent frame: cm, rad, x forward, y left, counter-clockwise.
    A rejected input raises ValueError and leaves the follower unchanged.
    """

    def __init__(
        self,
        model: GazeModel,
        agent: Pose2,
        agent_heading: float = 0.0,
        prior: Gaussian | None = None,
        most_moved: float = 30.0,
    ) -> None:
        """A follower without a mentor.

        Args:
            model: the trained agent.
            agent: the agent's frame in the parent frame: origin at its head, x its default gaze.
            agent_heading: its current heading in its own frame, rad.
            prior: of the goal in the parent frame (2,); default: simulation.goal_prior.
            most_moved: largest distance of the mentor's head from its start position, cm.
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
        """The current mentor."""
        return self._mentor

    @property
    def observations(self) -> int:
        """Number of observed final states of this mentor."""
        return len(self._seen)

    @property
    def following(self) -> Following | None:
        """The result of the last observation."""
        return self._last

    def start(self, pose: Pose2, blindfolded: bool = False) -> Mentor:
        """Start with a mentor, whose head is at `pose` before it moves; replaces the one before.

        Raises:
            ValueError: values that are not finite, or a mentor too close to the agent.
        """
        head = checked_pose("the mentor's start pose", pose)
        away = math.hypot(head.x - self.agent.x, head.y - self.agent.y)
        if away < MIN_DISTANCE:
            raise ValueError(
                f'Expected the mentor at least {MIN_DISTANCE:g} cm from the agent, '
                f'got {away:.1f} cm.'
            )
        frame = head.facing(self.agent.x, self.agent.y)
        self._mentor = Mentor(frame, float(wrapped(head.heading - frame.heading)), blindfolded)
        self._seen, self._last = [], None
        return self._mentor

    def observe(self, pose: Pose2, distance: float | None = None) -> Following:
        """Add the mentor's head pose after a turn and infer what it looks at.

        Several observations of one mentor are executions of one goal, each from the start pose.

        Args:
            pose: of the head.
            distance: fixation distance, cm, if measured: for all observations of a mentor or for
                none.

        Raises:
            ValueError: no start pose yet, values that are not finite, a mentor that moved away, a
                distance that is not positive, or with and without a distance mixed.
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

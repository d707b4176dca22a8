"""Forward inference, and following a mentor's gaze by reverse and forward inference (Fig 1c)."""

from __future__ import annotations

from typing import NamedTuple

from likeme_gaze.beliefs import Gaussian, independent
from likeme_gaze.chain import GOAL, HeadModel, chain
from likeme_gaze.frames import Pose2
from likeme_gaze.reverse import Evidence, infer_goal


class Forward(NamedTuple):
    """What an agent will do and where that leads; batches add leading axes.

    Attributes:
        action: P(a) = N, (turn rad, distance cm).
        final: P(x_f) = N, (heading rad, distance cm).
    """

    action: Gaussian
    final: Gaussian


def forward_inference(
    model: HeadModel, goal: Gaussian, start: Gaussian, keep_coupling: bool = True
) -> Forward:
    """P(X_f | X_i = x_i, G = g) through the action (Goal-directed Planning).

    Args:
        model: policy and transition.
        goal: belief about the goal (..., 2) in the agent's own frame; `known(g)` for a known one.
        start: belief about x_i (..., S).
        keep_coupling: whether action and start stay correlated.
    """
    linear = chain(model, independent(goal, start), keep_coupling)
    return Forward(linear.action, linear.final)


class Following(NamedTuple):
    """What the mentor probably looks at, and the head movement that looks there too.

    Attributes:
        mentor: posterior of (goal, x_i) in the mentor's frame.
        goal: posterior of the goal in the agent's frame, cm.
        action: the agent's action (turn rad, distance cm).
        final: its predicted final state (heading rad, distance cm).
    """

    mentor: Gaussian
    goal: Gaussian
    action: Gaussian
    final: Gaussian


class Viewpoints(NamedTuple):
    """The two frames in their common parent, and how the agent's head starts (heading rad)."""

    agent: Pose2
    mentor: Pose2
    agent_start: Gaussian


def follow_gaze(
    heads: tuple[HeadModel, HeadModel],
    prior: Gaussian,
    evidence: Evidence,
    views: Viewpoints,
    around: Gaussian | None = None,
) -> Following:
    """Infer the mentor's goal, carry it into the agent's frame, infer how to fixate it.

    Args:
        heads: the model put in the mentor's place, and the agent's own.
        prior: of (goal, x_i) in the mentor's frame (..., 2 + S).
        evidence: the mentor's final states.
        views: frames and the agent's start.
        around: posterior of (goal, x_i) without the last observation; see infer_goal.
    """
    mentor = infer_goal(heads[0], prior, evidence, around)
    goal = views.agent.belief_from_parent(views.mentor.belief_to_parent(mentor.part(0, GOAL)))
    return Following(mentor, goal, *forward_inference(heads[1], goal, views.agent_start))

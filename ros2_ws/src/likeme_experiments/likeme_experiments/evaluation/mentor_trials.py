"""Trials of gaze.sh: the simulated mentor's movements, the robot's score, and the printed table.

Lengths in m, angles in rad, positions in the robot's frame.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from likeme_gaze import Gaussian, Pose2, SimulationSetup
from likeme_gaze.beliefs import mahalanobis
from likeme_gaze.blindfold import THRESHOLDS, TURN
from likeme_gaze.mentor.head_pose import CM_PER_M
from likeme_gaze.mentor.log_messages import neck_direction
from likeme_gaze.simulation import DEGREE, aim, execute

#: Least turn that counts as following, rad: the paper's threshold.
THRESHOLD = THRESHOLDS[0]
#: 95 % of a Gaussian in the plane lies within this squared Mahalanobis distance.
INSIDE_95 = -2 * math.log(0.05)


class MentorScene(NamedTuple):
    """Poses of robot and mentor, by the gaze node's parameters.

    Attributes:
        frame: name of the robot's frame.
        robot: the robot's head.
        mentor: the mentor's frame.
        observations: head poses in a trial.
    """

    frame: str
    robot: Pose2
    mentor: Pose2
    observations: int

    @property
    def away(self) -> float:
        """Distance of the mentor from the robot."""
        return math.hypot(self.mentor.x - self.robot.x, self.mentor.y - self.robot.y)

    @property
    def to_mentor(self) -> float:
        """The neck angle that faces the mentor."""
        return self.robot.facing(self.mentor.x, self.mentor.y).heading - self.robot.heading


class GazeTrial(NamedTuple):
    """One trial.

    Attributes:
        side: 1 when the target is on the robot's left, -1 on its right.
        target: of the mentor's gaze (2,).
        start: the mentor's head before it moves.
        turns: its head after each execution, and the distance at which its eyes converge.
    """

    side: int
    target: tuple[float, float]
    start: Pose2
    turns: tuple[tuple[Pose2, float], ...]


class RobotResponse(NamedTuple):
    """The robot's response to a trial: inferred goal (2,) and commanded neck angle."""

    goal: Gaussian
    neck: float


def draw_trials(rng: np.random.Generator, scene: MentorScene, count: int) -> Iterator[GazeTrial]:
    """Equally many trials to the left and right (an odd one on a random side), in random order."""
    sides = [1, -1] * (count // 2) + [int(rng.choice([1, -1]))] * (count % 2)
    for side in rng.permutation(sides):
        yield draw_trial(rng, scene, int(side))


def draw_trial(rng: np.random.Generator, scene: MentorScene, side: int) -> GazeTrial:
    """The mentor turns several times from the robot to a target equally far from both."""
    setting = SimulationSetup()
    facing = Pose2(*scene.mentor).facing(scene.robot.x, scene.robot.y)
    # The mentor faces the robot: its right is the robot's left.
    along, across = scene.away / 2, -side * scene.away / 2 * math.tan(TURN)
    x, y = facing.to_parent((along, across))
    wanted = aim(np.array([along, across]) * CM_PER_M, np.zeros(()))
    shown = np.broadcast_to(wanted, (scene.observations, 2))
    _, final = execute(rng, shown, np.zeros(scene.observations), setting)
    turns = tuple(
        (facing._replace(heading=facing.heading + float(heading)), float(distance) / CM_PER_M)
        for heading, distance in final
    )
    return GazeTrial(side, (float(x), float(y)), facing, turns)


def turn_of(scene: MentorScene, response: RobotResponse) -> float:
    """The robot's turn away from the mentor, left positive, in [-pi, pi)."""
    return (response.neck - scene.to_mentor + math.pi) % (2 * math.pi) - math.pi


def score(trial: GazeTrial, turn: float) -> int:
    """+1 for a turn of at least 30 degrees the right way, -1 the wrong way, 0 for less."""
    if abs(turn) < THRESHOLD:
        return 0
    return 1 if turn * trial.side > 0 else -1


def inside(trial: GazeTrial, response: RobotResponse) -> bool:
    """Whether the target lies in the 95 % region of the inferred goal."""
    return bool(mahalanobis(response.goal, np.array(trial.target)) <= INSIDE_95)


HEADER = (
    'trial  the mentor turns to     the robot infers, m               in 95 %  '
    'the robot turns      score'
)


def line(number: int, scene: MentorScene, trial: GazeTrial, response: RobotResponse) -> str:
    """One line of the table."""
    turn = turn_of(scene, response)
    side, (x, y) = 'left' if trial.side > 0 else 'right', trial.target
    target, goal = f'{side:5} ({x:.2f}, {y:.2f}) m', goal_text(response.goal)
    held = 'yes' if inside(trial, response) else 'no'
    return (
        f'{number:5}  {target:22}  {goal:32}  {held:6}  '
        f'{neck_direction(turn):19}  {signed(score(trial, turn)):>5}'
    )


def goal_text(goal: Gaussian) -> str:
    """Mean and standard deviations: '(3.26 ± 1.11, 2.48 ± 0.78)'."""
    # Adding 0 turns -0 into 0.
    (x, y), (dx, dy) = goal.mean.round(2) + 0.0, np.sqrt(np.diag(goal.covariance))
    return f'({x:.2f} ± {dx:.2f}, {y:.2f} ± {dy:.2f})'


def signed(points: int) -> str:
    """'+1', '0' or '-1'."""
    return f'{points:+d}' if points else '0'


def summary(scores: Sequence[int]) -> str:
    """The total and the mean."""
    mean = np.mean(scores)
    return (
        f'Score {signed(sum(scores))} of {len(scores)}, mean {mean:.2f}: +1 for a turn of at '
        f'least {THRESHOLD / DEGREE:.0f} degrees the right way, -1 the wrong way.'
    )


def scene_from(
    frame: str, robot: Sequence[float], mentor: Sequence[float], seen: int
) -> MentorScene:
    """The scene of the node's parameters base_frame, robot_head, mentor_pose, observations."""
    return MentorScene(frame, Pose2(*robot), Pose2(*mentor), seen)

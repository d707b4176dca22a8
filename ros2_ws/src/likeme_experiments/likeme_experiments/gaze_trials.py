"""The simulated mentor of gaze.sh: what it does, how the robot's turn is scored, and the words.

Pure functions; nothing here knows ROS. Lengths in m, angles in rad, places in the robot's frame.
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
from likeme_gaze.mentor.sentences import turned
from likeme_gaze.simulation import DEGREE, aim, execute

#: What counts as following, rad: the paper's threshold.
THRESHOLD = THRESHOLDS[0]
#: 95 % of a Gaussian in the plane lies within this squared Mahalanobis distance.
INSIDE_95 = -2 * math.log(0.05)


class Scene(NamedTuple):
    """Where the two are, as the node's parameters say.

    Attributes:
        frame: name of the robot's frame, which all else is in.
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
        """How far the mentor is from the robot."""
        return math.hypot(self.mentor.x - self.robot.x, self.mentor.y - self.robot.y)

    @property
    def to_mentor(self) -> float:
        """The neck's angle that looks at the mentor."""
        return self.robot.facing(self.mentor.x, self.mentor.y).heading - self.robot.heading


class Trial(NamedTuple):
    """One trial.

    Attributes:
        side: 1 when the target is on the robot's left, -1 on its right.
        target: what the mentor looks at (2,).
        start: the mentor's head before it moves.
        turns: its head after each execution, and how far away its eyes converge.
    """

    side: int
    target: tuple[float, float]
    start: Pose2
    turns: tuple[tuple[Pose2, float], ...]


class Reply(NamedTuple):
    """What the robot made of a trial: goal (2,), and the neck's angle it was told to take."""

    goal: Gaussian
    neck: float


def draw_trials(rng: np.random.Generator, scene: Scene, count: int) -> Iterator[Trial]:
    """As many trials to the left as to the right (one more on a random side), in random order."""
    sides = [1, -1] * (count // 2) + [int(rng.choice([1, -1]))] * (count % 2)
    for side in rng.permutation(sides):
        yield draw_trial(rng, scene, int(side))


def draw_trial(rng: np.random.Generator, scene: Scene, side: int) -> Trial:
    """The mentor turns from the robot to a target as far from either of them, several times."""
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
    return Trial(side, (float(x), float(y)), facing, turns)


def turn_of(scene: Scene, reply: Reply) -> float:
    """The robot's turn away from the mentor, left positive, in [-pi, pi)."""
    return (reply.neck - scene.to_mentor + math.pi) % (2 * math.pi) - math.pi


def score(trial: Trial, turn: float) -> int:
    """+1 for a turn of at least 30 degrees the right way, -1 the wrong way, 0 for less."""
    if abs(turn) < THRESHOLD:
        return 0
    return 1 if turn * trial.side > 0 else -1


def inside(trial: Trial, reply: Reply) -> bool:
    """Whether the 95 % region of the inferred goal holds the target."""
    return bool(mahalanobis(reply.goal, np.array(trial.target)) <= INSIDE_95)


HEADER = (
    'trial  the mentor turns to     the robot infers, m               in 95 %  '
    'the robot turns      score'
)


def line(number: int, scene: Scene, trial: Trial, reply: Reply) -> str:
    """One line of the table."""
    turn = turn_of(scene, reply)
    side, (x, y) = 'left' if trial.side > 0 else 'right', trial.target
    held = 'yes' if inside(trial, reply) else 'no'
    return (
        f'{number:5}  {f"{side:5} ({x:.2f}, {y:.2f}) m":22}  {believed(reply.goal):32}  {held:6}  '
        f'{turned(turn):19}  {signed(score(trial, turn)):>5}'
    )


def believed(goal: Gaussian) -> str:
    """A place and its standard deviations: '(3.26 ± 1.11, 2.48 ± 0.78)'."""
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


def scene_from(frame: str, robot: Sequence[float], mentor: Sequence[float], seen: int) -> Scene:
    """The scene of the node's parameters base_frame, robot_head, mentor_pose, observations."""
    return Scene(frame, Pose2(*robot), Pose2(*mentor), seen)

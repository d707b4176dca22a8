"""Success that is promised at the goal that was meant, beside what is realised there.

Robots of 10 trials a pair in the real robot's table (judgement_robots, seed 1); a person who acts
as the robot would shows one of the 12 changes; what is shown leaves the object elsewhere, and the
robot takes one action for the goal it infers. Exact over changes, demonstrations and outcomes.
To say where a gap comes from, parts of what the robot knows are replaced by the truth.

Then sessions (seed 4) with `asking: promise`: each episode one of the changes by chance, with help
for what the robot asks, by the person, where it was meant.
"""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from judgement_robots import GOAL, MODEL, OBJECT, TABLE, X_I, Learned, robots
from likeme_core.observations import Demonstration, TableSnapshot
from likeme_core.outcomes import MotionOutcome
from likeme_core.tabletop import Manner
from likeme_core.world import load_world
from likeme_inference.tabletop import GoalModel, TransitionModel
from likeme_inference.tabletop.arrays import FloatArray
from likeme_inference.tabletop.asking import Asking
from likeme_inference.tabletop.domain import Policy
from likeme_inference.tabletop.goal_model import Estimated
from likeme_inference.tabletop.imitation import ImitationSettings
from likeme_inference.tabletop.intended_success import intended_success, meant
from likeme_inference.tabletop.prior import Prior
from likeme_inference.tabletop.robot_model import RobotModel, TrialCounts
from likeme_inference.tabletop.session import ImitationSession
from likeme_inference.tabletop.session_state import Phase
from likeme_inference.tabletop.values import Decision, MotionReport, Outcome, Reply
from report import Bar

WORLDS = 1000
#: Greatest difference of promised and realised, points.
MOST = 2.0
TARGETS = (0.8, 0.9, 0.95)
#: Sessions, their episodes, and those that are left out at the start of the later figure.
SESSIONS, EPISODES, EARLY = 100, 300, 100


class Shown(NamedTuple):
    """A demonstration from which the robot infers a goal other than the object's state.

    Attributes:
        probability: that it is shown and goal g was meant, all changes as likely, shape [g].
        goal, action: the robot's.
    """

    probability: FloatArray
    o: int
    x_i: int
    x_f: int
    goal: int
    action: int


class Known(NamedTuple):
    """What is known of an object: with its uncertainty, taken as certain, and the truth."""

    learned: GoalModel
    certain: GoalModel
    truth: GoalModel


PEOPLE = [GoalModel.of(world, MODEL.domain) for world in TABLE]


def bars(options: Namespace) -> list[Bar]:
    """Promises of single actions with the parts of their gap, then of sessions."""
    number = WORLDS if options.worlds is None else max(1, options.worlds)
    learned = robots(number, seed=1)
    made: list[Bar] = []
    for name in Learned._fields:
        each = [_known(robot, name) for robot in learned]
        made += _promised(each, name)
    return made + _sessions([robot.frequencies for robot in learned[:SESSIONS]])


def _known(robot: Learned, name: str) -> list[Known]:
    found = []
    for o, (counts, truth) in enumerate(zip(robot.frequencies, PEOPLE, strict=True)):
        known = TransitionModel(counts.astype(np.int64), getattr(robot, name)[o] - counts)
        learned = GoalModel.of(known, MODEL.domain)
        if learned.estimated is None:
            # As `promising_model`.
            learned = replace(learned, estimated=Estimated(robot.shared[o], Policy.DIRECT))
        found.append(Known(learned, GoalModel.of(known.transition, MODEL.domain), truth))
    return found


def _shown(known: list[Known]) -> Iterator[Shown]:
    for o, x in np.unique([OBJECT, X_I], axis=1).T.tolist():
        wanted = np.isin(np.arange(len(TABLE[o, x, 0])), GOAL[(o == OBJECT) & (x == X_I)])
        ends = wanted[:, None] * (PEOPLE[o].policy[x] @ TABLE[o, x]) / len(GOAL)
        for x_f in np.flatnonzero(ends.sum(axis=0)).tolist():
            goal = int(known[o].certain.goal_posterior(x, x_f).argmax())
            if x_f != x and goal != x:
                action = int(known[o].certain.success(x, goal).argmax())
                yield Shown(ends[:, x_f], o, x, x_f, goal, action)


#: Success of every action at the goal that was meant, by how much of it is known.
WAYS: dict[str, Callable[[Known, Shown], FloatArray]] = {
    'the likeliest goal taken as certain': lambda k, s: k.certain.success(s.x_i, s.goal),
    "by the paper's goal posterior": lambda k, s: intended_success(
        k.certain, s.x_i, k.certain.goal_posterior(s.x_i, s.x_f)
    ),
    "by the paper's goal posterior, knowing the table": lambda k, s: intended_success(
        k.truth, s.x_i, k.truth.goal_posterior(s.x_i, s.x_f)
    ),
    'by a person who only acts off the goal': lambda k, s: intended_success(
        k.certain, s.x_i, meant(k.certain, s.x_i, s.x_f)
    ),
    'the same, knowing the choices': lambda k, s: intended_success(
        k.certain, s.x_i, meant(k.truth, s.x_i, s.x_f)
    ),
    'the same, knowing the successes': lambda k, s: intended_success(
        k.truth, s.x_i, meant(k.certain, s.x_i, s.x_f).sum(axis=0)
    ),
    'the same, knowing the table': lambda k, s: intended_success(
        k.truth, s.x_i, meant(k.truth, s.x_i, s.x_f)
    ),
    'both with one theta, as the robot does': lambda k, s: intended_success(
        k.learned, s.x_i, meant(k.learned, s.x_i, s.x_f)
    ),
}
BARRED = 'both with one theta, as the robot does'


def _promised(learned: list[list[Known]], name: str) -> list[Bar]:
    promised, realised, episodes = dict.fromkeys(WAYS, 0.0), 0.0, 0.0
    for known in learned:
        for shown in _shown(known):
            weight = float(shown.probability.sum())
            episodes += weight
            realised += float(shown.probability @ TABLE[shown.o, shown.x_i, shown.action])
            for way, success in WAYS.items():
                promised[way] += weight * float(success(known[shown.o], shown)[shown.action])
    n, what = len(learned), f'success meant, {name}'
    made = [Bar(f'{what}: realised', realised / episodes, None, '', n=n)]
    for way, total in promised.items():
        off = 100 * (total - realised) / episodes
        bound = MOST if way == BARRED else None
        made += [
            Bar(f'{what}: {way}: promised', total / episodes, None, '', n=n),
            Bar(f'{what}: {way}: off', abs(off), bound, 'points', n=n),
        ]
    return made


def _sessions(tables: list[FloatArray]) -> list[Bar]:
    made = []
    for target in TARGETS:
        runs = [_run(counts, target, seed) for seed, counts in enumerate(tables)]
        first, later = (
            np.mean([run[part] for run in runs], axis=(0, 1))
            for part in (slice(0, EARLY), slice(EARLY, None))
        )
        for when, (at_meant, at_inferred, helped) in (
            (f'episodes 1 to {EARLY}', first), (f'from episode {EARLY + 1} on', later),
        ):  # fmt: skip
            what, n = f'session, promise {target:.2f}, {when}', len(runs)
            off = 100 * abs(float(at_meant) - target)
            made += [
                Bar(f'{what}: off at the goal meant', off, MOST, 'points', n=n),
                Bar(f'{what}: reached the goal meant', float(at_meant), None, '', n=n),
                Bar(f'{what}: reached the goal inferred', float(at_inferred), None, '', n=n),
                Bar(f'{what}: help', 100 * float(helped), None, '%', n=n),
            ]  # fmt: skip
    return made


def _run(counts: FloatArray, target: float, seed: int) -> FloatArray:
    """Whether the goal meant was reached, the inferred one, whether it asked; [episode, 3]."""
    rng, world = np.random.default_rng([4, seed]), load_world()
    settings = ImitationSettings(
        asking=Asking.PROMISE, promise=target, prior=Prior.SHARED, turn_delay=0
    )
    session = ImitationSession(_robot(counts), settings)
    found: list[tuple[bool, bool, bool]] = []
    names, now = list(MODEL.objects), 0
    while len(found) < EPISODES:
        task = int(rng.integers(len(GOAL)))
        o, x, g = int(OBJECT[task]), int(X_I[task]), int(GOAL[task])
        x_f = int(rng.choice(3, p=PEOPLE[o].policy[x, g] @ TABLE[o, x]))
        if x_f == x:
            continue
        now += 100_000_000_000
        session.observe_demonstration(
            Demonstration(
                now, 'camera', names[o], world.states[x], world.states[x_f], Manner.PLACE,
                now - 2_000_000_000, now - 100_000_000,
            )
        )  # fmt: skip
        rest = dict.fromkeys(names, world.states[x])
        decision = session.look(TableSnapshot(now + 5_000_000_000, 'camera', True, rest))
        if not isinstance(decision, Decision) or decision.action is None:
            # It infers that the object is where it was wanted.
            continue
        acted, end = session.phase is Phase.ACTING, g
        if acted:
            end = int(rng.choice(3, p=TABLE[o, x, decision.action]))
            done = MotionReport(MotionOutcome.COMPLETED, 'Done.', now + 10_000_000_000)
            session.motion_finished(done)
        else:
            session.answered(Reply.DONE_BY_HAND)
        after = rest | {names[o]: world.states[end]}
        outcome = session.look(TableSnapshot(now + 20_000_000_000, 'camera', True, after))
        assert isinstance(outcome, Outcome), f'Expected an outcome, got {outcome}.'
        found.append((end == g, not acted or end == decision.goal, not acted))
    return np.array(found, dtype=np.float64)


def _robot(counts: FloatArray) -> RobotModel:
    rows = tuple(
        TrialCounts(name, x, a, tuple(counts[o, x, a].astype(int).tolist()), 'table')
        for o, name in enumerate(MODEL.objects)
        for x in range(counts.shape[1])
        for a in range(counts.shape[2])
    )
    return RobotModel('drawn', '1', {'table': 'drawn from the table'}, rows, MODEL.domain)

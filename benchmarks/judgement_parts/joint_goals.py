"""Goals over the whole table from simulated people (evaluation/people.py), and their speed.

Of each kind of people `--seeds` (250) show twelve demonstrations each. Top-1 is of their first
six, during the demonstration (after 3/4 of the acts, rounded up) and after the person stopped; the
calibration error of the other six.
"""

from __future__ import annotations

import time
from argparse import Namespace
from collections.abc import Callable, Iterable, Sequence
from statistics import mean

import numpy as np

from likeme_core.observations import TableSnapshot
from likeme_core.ros.time import time_msg
from likeme_core.world import World, load_world
from likeme_experiments.evaluation.intervals import calibration_error
from likeme_experiments.evaluation.joint_goals import Moment, watched
from likeme_experiments.evaluation.people import Kind
from likeme_inference.joint_observer import JointObserver, JointSettings
from likeme_inference.messages import joint_belief_msg
from likeme_inference.session_inputs import read_attempt
from likeme_inference.tabletop.attempts import Attempt
from likeme_inference.tabletop.goal_test import GoalTest
from likeme_inference.tabletop.joint_goals import JointGoals, learned_transitions
from likeme_inference.tabletop.model_file import shipped
from likeme_msgs.msg import Attempt as AttemptMsg
from report import Bar

#: People of each kind, and their seed.
PEOPLE, SEED = 250, 0
#: Demonstrations of a person; those from CARRIED on are held against the calibration bars.
EACH, CARRIED = 12, 7
#: Top-1 after 3/4 of the acts and after the stop.
TOP_1 = {Kind.SENSIBLE: (0.88, 0.96), Kind.FAILING: (0.76, 0.93), Kind.CANDIDATES: (0.85, 0.96)}
#: Greatest distance from the observer who is told the person's rationality and skill.
BEHIND = {Kind.CLUMSY: 0.01, Kind.HABITUAL: 0.01, Kind.OFF_GRID: 0.01, Kind.SKILLED: 0.06}
#: Kinds with a goal that stays.
STEADY = (Kind.SENSIBLE, *BEHIND)
#: Seed of the simulation behind the test of "none of these", and its level.
TEST_SEED, LEVEL = 0, 0.05
UPDATES, NODE_EVENTS = 20_000, 6_000
MS = 1e3
PROTOTYPE = 'prototype'


def bars(options: Namespace) -> list[Bar]:
    """All figures; `options.seeds`: people of each kind, None for the default."""
    world = load_world()
    transitions = learned_transitions(world, shipped(world))
    goals, people = JointGoals(world, transitions), options.seeds or PEOPLE
    test = GoalTest.of(goals, np.random.default_rng(TEST_SEED), LEVEL)
    seen = {kind: watched(kind, world, transitions, people, EACH, SEED, test) for kind in Kind}
    early = {
        kind: [m for m in moments if m.demonstration < CARRIED] for kind, moments in seen.items()
    }
    return [
        *_top_1(early),
        *_behind(early),
        *_calibration(seen),
        *_none(seen),
        *_speed(goals),
        *_in_the_node(world),
    ]


def _top_1(seen: dict[Kind, list[Moment]]) -> list[Bar]:
    found = []
    for kind in Kind:
        if kind is Kind.AIMLESS:
            continue
        for (when, some), bar in zip(
            _scored(seen[kind]), TOP_1.get(kind, (None,) * 2), strict=True
        ):
            name, n = f'top-1, {kind}, {when}', len(some)
            peer = None if bar is None else PROTOTYPE
            told, today = _share(m.told for m in some), _share(m.act_by_act for m in some)
            found += [
                Bar(name, _share(m.right for m in some), bar, 'of 1', peer, n, False),
                Bar(f'{name}, told the rationality', told, None, 'of 1', None, n, False),
                Bar(f'{name}, act by act', today, None, 'of 1', None, n, False),
            ]
    return found


def _behind(seen: dict[Kind, list[Moment]]) -> list[Bar]:
    return [
        Bar(f'behind who is told, {kind}, {when}',
            _share(m.told for m in some) - _share(m.right for m in some), bar, 'of 1', PROTOTYPE,
            len(some))
        for kind, bar in BEHIND.items()
        for when, some in _scored(seen[kind])
    ]  # fmt: skip


def _calibration(seen: dict[Kind, list[Moment]]) -> list[Bar]:
    late: dict[Kind, list[Moment]] = {
        kind: [m for m in seen[kind] if m.demonstration >= CARRIED]
        for kind in Kind if kind is not Kind.AIMLESS
    }  # fmt: skip
    pooled = [m for kind in STEADY for m in late[kind]]
    found = []
    for name, moments, held in [
        (Kind.SENSIBLE, late[Kind.SENSIBLE], True), ('steady people', pooled, True),
        *((kind, late[kind], False) for kind in late if kind is not Kind.SENSIBLE),
    ]:  # fmt: skip
        for when, stopped, bar in [('per act', False, 0.03), ('after the stop', True, 0.015)]:
            some = [m for m in moments if m.stopped is stopped]
            error = calibration_error([m.probability for m in some], [m.right for m in some])
            found.append(
                Bar(f'ECE from demonstration {CARRIED}, {name}, {when}', error,
                    bar if held else None, 'of 1', PROTOTYPE if held else None, len(some))
            )  # fmt: skip
    return found


def _none(seen: dict[Kind, list[Moment]]) -> list[Bar]:
    """Of "none of these" after the stop."""
    stops = {kind: [m for m in moments if m.stopped] for kind, moments in seen.items()}
    aimless = stops[Kind.AIMLESS]
    longer = [m for m in aimless if m.of >= 4]
    return [
        Bar('"none of these", aimless', _share(m.none for m in aimless), None, 'of 1', None,
            len(aimless), False),
        Bar('"none of these", aimless, 4 acts or more', _share(m.none for m in longer), None,
            'of 1', None, len(longer), False),
        *(
            Bar(f'"none of these", {kind}', _share(m.none for m in stops[kind]),
                LEVEL if kind in STEADY and kind is not Kind.OFF_GRID else None, 'of 1',
                None, len(stops[kind]))
            for kind in Kind if kind is not Kind.AIMLESS
        ),
    ]  # fmt: skip


def _speed(goals: JointGoals) -> list[Bar]:
    """Single updates; the bars are of wall time, which other work on the machine lengthens."""
    rng, states = np.random.default_rng(0), len(goals.world.states)

    def certain() -> int:
        return int(rng.integers(states))

    def soft() -> list[float]:
        drawn: list[float] = rng.dirichlet(np.ones(states)).tolist()
        return drawn

    draws: list[tuple[str, Callable[[], int | list[float]], float]] = [
        ('certain', certain, 0.1),
        ('soft', soft, 0.2),
    ]
    found = []
    for name, draw, bar in draws:
        wall, processor = _spent(goals, draw, rng)
        for what, times, q, limit in [
            ('', wall, 50, None), ('', wall, 99, bar), (', processor time', processor, 99, None),
        ]:  # fmt: skip
            found.append(
                Bar(f'one update, {name} states, p{q}{what}', float(np.percentile(times, q)) * MS,
                    limit, 'ms', 'published peers: 860 to 28,000 ms' if limit else None, UPDATES)
            )  # fmt: skip
    return found


def _in_the_node(world: World) -> list[Bar]:
    """Processor time from an attempt's message to that of the belief, as the node spends it."""
    rng, second = np.random.default_rng(0), 1_000_000_000
    observer, stamp = JointObserver(world, shipped(world), JointSettings()), second
    certain, soft = np.eye(len(world.states)), 0.98 * np.eye(len(world.states)) + 0.01
    soft /= soft.sum(axis=1, keepdims=True)
    spent = []
    for k in range(NODE_EVENTS):
        # The person stops after every twelfth event.
        stamp += second if k % 12 else 10 * second
        observer.look(
            TableSnapshot(stamp - 1, '', True, dict.fromkeys(world.objects, world.states[0]))
        )
        x = int(rng.integers(len(world.states)))
        p = (soft if rng.random() < 0.5 else certain)[x].tolist()
        under_way = k % 2 == 0
        msg = AttemptMsg(
            world=world.label, object=world.objects[int(rng.integers(len(world.objects)))],
            manner=world.actions[-1].manner, manner_probability=0.98, x_i=x, x_i_probability=p,
            direction=int(rng.integers(len(world.states))), under_way=under_way,
            x_f=AttemptMsg.UNKNOWN if under_way else x,
            x_f_probability=[] if under_way else p, start=time_msg(stamp - 2), end=time_msg(stamp),
        )  # fmt: skip
        msg.header.stamp = time_msg(stamp)
        observer.look(TableSnapshot(stamp, '', False, {}))
        begin = time.thread_time()
        told = observer.see(read_attempt(msg, world))
        for belief in told:
            joint_belief_msg(world, belief)
        if told:
            spent.append(time.thread_time() - begin)
    name = 'one event in the node, processor time, p'
    return [
        Bar(f'{name}{q}', float(np.percentile(spent, q)) * MS, bar, 'ms', None, len(spent))
        for q, bar in ((50, None), (99, 1.0))
    ]


def _spent(
    goals: JointGoals, draw: Callable[[], int | list[float]], rng: np.random.Generator
) -> tuple[list[float], list[float]]:
    """Wall and processor time of each update, s."""
    actions, wall, processor = len(goals.world.actions), [], []
    for k in range(UPDATES):
        if k % 6 == 0:
            watcher = goals.watch({name: draw() for name in goals.objects})
        name = goals.objects[int(rng.integers(len(goals.objects)))]
        event = Attempt(name, draw(), draw(), action=int(rng.integers(actions)))
        begin, used = time.perf_counter(), time.thread_time()
        watcher.see(event)
        processor.append(time.thread_time() - used)
        wall.append(time.perf_counter() - begin)
    return wall, processor


def _scored(moments: Sequence[Moment]) -> list[tuple[str, list[Moment]]]:
    return [
        ('at 3/4', [m for m in moments if m.at_part]),
        ('after the stop', [m for m in moments if m.stopped]),
    ]


def _share(values: Iterable[bool]) -> float:
    return mean(map(float, values))

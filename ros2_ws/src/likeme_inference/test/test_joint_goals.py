"""Joint goals: every posterior against enumeration by loops, and what is refused."""

from __future__ import annotations

import math
from functools import cache
from itertools import pairwise, product
from typing import Any

import numpy as np
import pytest

from likeme_core.paper_world import (
    LEFT,
    OFFTABLE,
    PLACE_LEFT,
    PUSH_LEFT,
    PUSH_RIGHT,
    RIGHT,
    WORLD,
)
from likeme_core.tabletop import Manner
from likeme_core.world import load_world
from likeme_inference.tabletop import Attempt, GoalTest, JointGoals, Stopped, shipped

EXACT = {'rel': 0, 'abs': 1e-12}
COST, GIVING_UP, CHANGE = 0.1, 0.03, {0.0: 0.7, 0.2: 0.3}
START = {'pear': LEFT, 'lemon': LEFT, 'chicken': RIGHT}

Table = Any


def space(**options: Any) -> JointGoals:
    return JointGoals.of(WORLD, shipped(), **options)


def random_transitions(names: list[str], rng: np.random.Generator) -> dict[str, Table]:
    return {name: rng.dirichlet(np.ones(3), (3, 6)) for name in names}


def moves(transition: Table, s: float) -> Table:
    """p_s(x_f | x_i, a) by definition."""
    p = np.zeros((3, 6, 3))
    for x, a, y in product(range(3), range(6), range(3)):
        hit = float(y == WORLD.actions[a].target)
        p[x, a, y] = (1 - s) * transition[x, a, y] + s * hit if x != OFFTABLE else float(x == y)
    return p


def advantages(p: Table, g: int | None) -> tuple[Table, list[float]]:
    """Of each act [x][a], and of leaving [x], by loops."""
    there = [float(g is None or x == g) for x in range(3)]
    value = there

    def acted(x: int, a: int) -> float:
        return math.fsum(p[x, a, y] * value[y] for y in range(3)) - COST

    for _ in range(600):
        value = [max(there[x], *(acted(x, a) for a in range(6))) for x in range(3)]
    act = [[acted(x, a) - value[x] for a in range(6)] for x in range(3)]
    return act, [there[x] - value[x] for x in range(3)]


class Enumerated:
    """P(event | goal, person) by definition, and the posterior over all sequences of goals."""

    def __init__(self, goals: JointGoals, transitions: dict[str, Table]) -> None:
        self.goals, self.names = goals, list(transitions)
        self.kinds = [(float(b), float(s)) for b, s, _ in goals.people]
        self.moves = {(n, s): moves(transitions[n], s) for n in self.names for _, s in self.kinds}
        every = (0, 1, 2, None)
        self.choice = cache(self._choice)
        self.advantages = {
            (n, s, g): advantages(self.moves[n, s], g)
            for n in self.names for _, s in self.kinds for g in every
        }  # fmt: skip

    def _choice(self, x: tuple[int, ...], goal: Any, kind: Any) -> tuple[dict[Any, float], float]:
        beta, s = kind
        each = [self.advantages[n, s, g] for n, g in zip(self.names, goal, strict=True)]
        act = {
            (n, a): math.exp(beta * each[k][0][x[k]][a])
            for k, n in enumerate(self.names) for a in range(6)
        }  # fmt: skip
        stop = math.exp(beta * math.fsum(each[k][1][x[k]] for k in range(len(x))))
        z = math.fsum([*act.values(), stop])
        left = {key: (1 - GIVING_UP) * w / z for key, w in act.items()}
        return left, GIVING_UP + (1 - GIVING_UP) * stop / z

    def likelihood(self, event: Any, where: list[Any], after: Any) -> Table:
        """Shape [goal, person]; where: distributions, after: of x_f or None."""
        found = np.zeros((len(self.goals.goals), len(self.kinds)))
        for (i, goal), (j, kind) in product(enumerate(self.goals.goals), enumerate(self.kinds)):
            for x in product(range(3), repeat=len(self.names)):
                weight = math.prod(float(b[k]) for b, k in zip(where, x, strict=True))
                if weight == 0:
                    continue
                act, stop = self.choice(x, goal, kind)
                if isinstance(event, Stopped):
                    found[i, j] += weight * stop
                    continue
                o = self.names.index(event.object)
                p = self.moves[event.object, kind[1]]
                for a in event.actions(WORLD):
                    told = 1.0 if after is None else math.fsum(p[x[o], a] * after)
                    found[i, j] += weight * act[event.object, a] * told
        return found

    def posterior(self, steps: list[Table]) -> Table:
        """Over all sequences of goals, one for each step; shape [goal, person]."""
        prior, change = self.goals.prior, self.goals.people[:, 2]
        goals, total = range(len(prior)), np.zeros((len(prior), len(self.kinds)))
        for sequence in product(goals, repeat=len(steps) if change.any() else 1):
            path = sequence if change.any() else sequence * len(steps)
            p = prior[path[0]]
            for before, now in pairwise(path):
                p *= (1 - change) * (before == now) + change * prior[now]
            total[path[-1]] += p * np.prod([s[g] for s, g in zip(steps, path, strict=True)], 0)
        total = total * self.goals.people_prior
        return total / total.sum()


def soft(seen: Any) -> Table:
    return np.eye(3)[seen] if isinstance(seen, int) else np.asarray(seen) / np.sum(seen)


@pytest.mark.parametrize('seed', range(2))
@pytest.mark.parametrize('certain', [True, False], ids=['certain', 'soft'])
def test_every_posterior_is_that_of_enumeration(seed: int, certain: bool) -> None:
    rng = np.random.default_rng([seed, certain])
    transitions = random_transitions(['pear', 'lemon'], rng)
    options = {'rationality': (4.0, 20.0), 'skill': (0.0, 0.7), 'prior': rng.dirichlet([1] * 15)}
    goals = JointGoals(WORLD, transitions, change_of_mind=CHANGE, **options)  # type: ignore[arg-type]
    exact = Enumerated(goals, transitions)

    def drawn(states: int = 3) -> Any:
        return int(rng.integers(states)) if certain else rng.dirichlet([1, 1, 1])

    # Not OFFTABLE, from which every other outcome is impossible.
    start = [drawn(2), drawn()]
    watcher = goals.watch(dict(zip(transitions, start, strict=True)))
    x, y = drawn(2), drawn()
    acts = [
        Attempt('lemon', x, manner=Manner.PUSH, under_way=True),
        Attempt('lemon', x, y, action=PUSH_RIGHT),
        Attempt('pear', None, drawn(), direction=LEFT),
        Stopped(),
    ]
    where, done = [soft(s) for s in start], []
    for event in acts:
        after = None
        if isinstance(event, Attempt):
            o = exact.names.index(event.object)
            where[o] = where[o] if event.x_i is None else soft(event.x_i)
            after = None if event.x_f is None else soft(event.x_f)
        now = exact.likelihood(event, where, after)
        expected = exact.posterior([*done, now])

        seen = watcher.see(event)

        assert watcher.weights == pytest.approx(expected, **EXACT)
        assert seen == pytest.approx(expected.sum(axis=1), **EXACT)
        for k, name in enumerate(exact.names):
            mass = [
                math.fsum(p for p, g in zip(seen, goals.goals, strict=True) if g[k] == state)
                for state in (0, 1, 2, None)
            ]
            assert watcher.marginal(name) == pytest.approx(mass, **EXACT)
        if after is not None:
            where[o] = after
            done.append(now)


def test_tables_computed_when_needed_are_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    events = [
        Attempt('pear', [0.5, 0.5, 0.0], under_way=True),
        Attempt('pear', [0.5, 0.5, 0.0], [0.2, 0.7, 0.1], manner=Manner.PUSH),
        Attempt('lemon', LEFT, LEFT, action=PUSH_RIGHT),
        Stopped(),
    ]
    at_once, found = space().watch(START), []
    monkeypatch.setattr('likeme_inference.tabletop.choice_tables.LARGEST', 5000)
    when_needed = space().watch(START)
    for event in events:
        found.append(at_once.see(event))
        assert when_needed.see(event) == pytest.approx(found[-1], **EXACT)


def test_the_paper_s_table_by_enumeration() -> None:
    transitions = {
        name: shipped().counted(name, 0.09).transition for name in ('pear', 'lemon', 'chicken')
    }
    goals = JointGoals(
        WORLD, transitions, rationality=(16, 64), skill=(0, 0.9), change_of_mind={0.0: 1.0}
    )
    exact = Enumerated(goals, transitions)
    watcher = goals.watch(START)
    events = [Attempt('lemon', 0, 0, action=PUSH_RIGHT), Attempt('pear', 0, 1, Manner.PUSH)]
    where, done = [np.eye(3)[int(x)] for x in START.values()], []
    for event in events:
        done.append(exact.likelihood(event, where, np.eye(3)[event.x_f]))
        where[exact.names.index(event.object)] = np.eye(3)[event.x_f]
        watcher.see(event)

    assert len(goals.goals) == 63
    assert watcher.weights == pytest.approx(exact.posterior(done), **EXACT)


def test_who_fails_twice_and_stops_is_understood() -> None:
    watcher = space().watch(START)
    for event in [Attempt('lemon', LEFT, LEFT, Manner.PUSH, RIGHT)] * 2:
        watcher.see(event)
    assert watcher.marginal('lemon').argmax() == RIGHT
    watcher.see(Stopped())

    assert watcher.marginal('lemon')[RIGHT] > 0.7
    changes = watcher.changes()
    assert max(changes, key=changes.__getitem__) == (None, RIGHT, None)
    assert sum(changes.values()) == pytest.approx(1)
    assert len([c for c in changes if any(g is not None for g in c)]) == 26


def test_a_correction_is_not_the_goal() -> None:
    watcher = space().watch(START)
    watcher.see(Attempt('pear', LEFT, RIGHT, action=PUSH_RIGHT))
    before = watcher.marginal('pear')[RIGHT]
    watcher.see(Attempt('pear', RIGHT, RIGHT, action=PUSH_LEFT))
    watcher.see(Attempt('pear', RIGHT, LEFT, action=PUSH_LEFT))

    assert before > 0.5
    assert watcher.marginal('pear')[RIGHT] < 0.2


def test_rationality_is_carried_to_the_next_demonstration() -> None:
    goals, rng = space(), np.random.default_rng(0)
    person = None
    for _ in range(6):
        watcher = goals.watch(START, person)
        for _ in range(5):
            name = goals.objects[rng.integers(3)]
            watcher.see(Attempt(name, None, None, action=int(rng.integers(6))))
        watcher.see(Stopped())
        person = watcher.person

    assert watcher.rationality < 16
    assert goals.watch(START, person).rationality == pytest.approx(watcher.rationality)
    assert goals.watch(START).rationality == pytest.approx(32)


def test_an_event_that_nothing_explains_leaves_the_posterior() -> None:
    goals = space(concentration=0, skill=(0.0,), change_of_mind={0.0: 1.0})
    watcher = goals.watch(START)
    watcher.see(Attempt('pear', LEFT, RIGHT, action=PUSH_RIGHT))
    before = watcher.posterior

    after = watcher.see(Attempt('pear', RIGHT, LEFT, action=PUSH_RIGHT))

    assert after.tolist() == before.tolist()
    assert watcher.unexplained == 1


def test_random_acts_are_none_of_the_goals() -> None:
    goals, rng = space(), np.random.default_rng(1)
    test = GoalTest.of(goals, np.random.default_rng(0), 0.05, 400)
    found, sure = 0, 0
    for _ in range(40):
        watcher = goals.watch(START)
        for _ in range(6):
            name, x_f = goals.objects[rng.integers(3)], int(rng.integers(2))
            watcher.see(Attempt(name, None, x_f, action=int(rng.integers(6))))
        watcher.see(Stopped())
        found += test.rejects(watcher)
        sure += watcher.p_value < 0.05
    purposeful = goals.watch(START)
    purposeful.see(Attempt('pear', LEFT, RIGHT, action=PUSH_RIGHT))
    purposeful.see(Stopped())

    assert found >= 28
    assert found >= sure >= 12
    assert not test.rejects(purposeful)
    assert purposeful.p_value == 1


def test_choices_sum_to_one() -> None:
    goals = space()
    for where in product(range(3), repeat=3):
        assert goals.choices(where, 5, 7).sum() == pytest.approx(1, **EXACT)


def test_another_world() -> None:
    world = load_world('three_bins')
    size = len(world.states), len(world.actions), len(world.states)
    transitions = {'a': np.full(size, 1 / size[2]), 'b': np.full(size, 1 / size[2])}
    goals = JointGoals(world, transitions)
    watcher = goals.watch({'a': 0, 'b': 1})
    watcher.see(Attempt('a', 0, 0, action=0))

    assert len(goals.goals) == (size[0] + 1) ** 2 - 1
    assert watcher.posterior.sum() == pytest.approx(1)


@pytest.mark.parametrize(
    ('event', 'said'),
    [
        (Attempt('plum', 0, 1), "Expected one of .*'pear'.*, got 'plum'"),
        (Attempt('pear', 3, 1), 'Expected x_i from 0 to 2, got 3'),
        (Attempt('pear', 0, [0.5, 0.5]), 'distributions over 3 states'),
        (Attempt('pear', 0, [0.0, 0.0, 0.0]), 'with a possible state'),
        (Attempt('pear', 0, 1, Manner.DROP), 'is an action of chung2015, got action None'),
        (Attempt('pear', 0, 1, under_way=True), 'no x_f of an act under way, got 1'),
        (Attempt('pear', 0, 1, action=PLACE_LEFT, direction=RIGHT), 'direction RIGHT'),
    ],
)
def test_refused_events_change_nothing(event: Attempt, said: str) -> None:
    watcher = space().watch(START)
    before = watcher.weights
    with pytest.raises(ValueError, match=said):
        watcher.see(event)
    assert watcher.weights is before


def test_refused_spaces() -> None:
    own = {name: np.full((3, 6, 3), 1 / 3) for name in ('a', 'b')}
    for options, said in [
        ({'goals': [(0,)]}, r'goals of 2 entries, got \(0,\)'),
        ({'goals': [(0, 4)]}, 'Expected goal from 0 to 2, got 4'),
        ({'goals': [(0, 1), (0, 1)]}, 'each once'),
        ({'rationality': (0.0,)}, 'rationality above 0'),
        ({'skill': (1.5,)}, r'Expected skill from 0 to 1, got \(1.5,\)'),
        ({'cost': 0.0}, 'cost of an act above 0, got 0'),
        ({'giving_up': 2.0}, r'Expected giving_up from 0 to 1, got \(2.0,\)'),
        ({'prior': [1.0]}, 'prior of shape'),
    ]:
        with pytest.raises(ValueError, match=said):
            JointGoals(WORLD, own, **options)  # type: ignore[arg-type]
    many = dict.fromkeys('abcdefg', own['a'])
    with pytest.raises(ValueError, match='give candidate goals'):
        JointGoals(WORLD, many)
    with pytest.raises(ValueError, match="start of \\['b'\\]"):
        JointGoals(WORLD, own).watch({'a': 0})
    watcher = JointGoals(WORLD, own).watch({'a': 0, 'b': 0})
    watcher.see(Stopped())
    with pytest.raises(ValueError, match='before the person stopped'):
        watcher.see(Stopped())

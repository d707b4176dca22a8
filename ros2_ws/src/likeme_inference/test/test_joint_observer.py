"""The observer of joint goals, held against the library that it feeds."""

from __future__ import annotations

import json
import sqlite3
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from likeme_core.observations import ObservedAttempt, TableSnapshot
from likeme_core.paper_world import LEFT, OFFTABLE, RIGHT, WORLD
from likeme_core.tabletop import Manner, State
from likeme_core.world import load_world
from likeme_inference.experience.decision_log import DecisionLog
from likeme_inference.joint_belief import JointBelief, belief_record, table_goal, told_events
from likeme_inference.joint_observer import SIMULATED, JointObserver, JointSettings
from likeme_inference.log_story import line
from likeme_inference.session_log import SessionLog
from likeme_inference.tabletop.attempts import Attempt, Stopped
from likeme_inference.tabletop.joint_goals import JointGoals
from likeme_inference.tabletop.model_file import shipped
from likeme_inference.value_json import to_json, to_text

SECOND = 1_000_000_000
START = {'pear': LEFT, 'lemon': LEFT, 'chicken': RIGHT}
MODEL = shipped(WORLD)


def ended(
    name: str, x_i: State, x_f: State | None, at: float, manner: Manner | None = Manner.PUSH,
    direction: State | None = None,
) -> ObservedAttempt:  # fmt: skip
    """An act that took a second and ended at a time, s."""
    stamp = round(at * SECOND)
    return ObservedAttempt(
        stamp, 'camera', name, x_i, x_f, manner, 0.98, direction, False, stamp - SECOND, stamp
    )


def under_way(seen: ObservedAttempt, before: float = 0.5) -> ObservedAttempt:
    """The same act before its end, s."""
    stamp = seen.stamp - round(before * SECOND)
    return replace(seen, x_f=None, under_way=True, stamp=stamp, end=stamp)


class Shown:
    """An observer, and the table that it sees ten times a second."""

    def __init__(self, settings: JointSettings | None = None, **states: State) -> None:
        self.observer = JointObserver(WORLD, MODEL, settings or JointSettings())
        self.states, self.time = {**START, **states}, 0.0
        self.beliefs: list[JointBelief] = []
        self.wait(1.0)

    def wait(self, seconds: float, settled: bool = True) -> None:
        for _ in range(round(seconds * 10)):
            self.time += 0.1
            view = TableSnapshot(round(self.time * SECOND), 'camera', settled, dict(self.states))
            self.beliefs += self.observer.look(view)

    def act(self, *seen: ObservedAttempt) -> None:
        for each in seen:
            self.wait(each.stamp / SECOND - self.time, settled=False)
            self.beliefs += self.observer.see(each)


def library(*events: Attempt | Stopped, person: object = None, **start: object) -> np.ndarray:
    """The posterior that the library has after these events."""
    watcher = JointGoals.of(WORLD, MODEL).watch({**START, **start}, person)  # type: ignore[arg-type]
    for event in events:
        watcher.see(event)
    return watcher.posterior


IN_VAIN = Attempt('lemon', LEFT, LEFT, Manner.PUSH, RIGHT)


def test_every_event_leads_to_the_library_s_posterior() -> None:
    shown = Shown()
    shown.act(ended('lemon', LEFT, LEFT, 3, direction=RIGHT))
    watcher = shown.observer.watcher
    assert watcher is not None
    np.testing.assert_array_equal(watcher.posterior, library(IN_VAIN))
    shown.act(ended('lemon', LEFT, LEFT, 5, direction=RIGHT))
    np.testing.assert_array_equal(watcher.posterior, library(IN_VAIN, IN_VAIN))
    belief = shown.beliefs[-1]
    assert belief.objects == ('pear', 'lemon', 'chicken')
    assert belief.marginals[1, RIGHT] > 0.98
    np.testing.assert_allclose(belief.marginals.sum(axis=1), 1)
    assert belief.changes == tuple(
        sorted(watcher.changes().items(), key=lambda item: -item[1])[:10]
    )
    assert (belief.events, belief.unexplained, belief.stopped) == (2, 0, False)
    assert belief.stamp == 5 * SECOND
    assert belief.demonstration == 3 * SECOND


def test_an_act_under_way_counts_at_once_and_is_replaced_by_its_end() -> None:
    shown, end = Shown(), ended('lemon', LEFT, LEFT, 3, direction=RIGHT)
    shown.act(under_way(end))
    assert shown.beliefs[-1].marginals[1, RIGHT] > 0.5
    shown.act(under_way(end, 0.2), end)
    watcher = shown.observer.watcher
    assert watcher is not None
    np.testing.assert_allclose(watcher.posterior, library(IN_VAIN), rtol=1e-12)
    assert len(shown.beliefs) == 3


def test_of_two_acts_at_once_each_counts_once() -> None:
    shown, pear = Shown(), ended('pear', LEFT, RIGHT, 4)
    lemon = ended('lemon', LEFT, LEFT, 3.5, direction=RIGHT)
    shown.act(under_way(pear, 1), under_way(lemon), lemon, pear)
    watcher = shown.observer.watcher
    assert watcher is not None
    expected = library(Attempt('pear', LEFT, RIGHT, Manner.PUSH), IN_VAIN)
    np.testing.assert_allclose(watcher.posterior, expected, rtol=1e-12)


def test_a_person_who_pauses_has_stopped_and_is_remembered() -> None:
    shown = Shown()
    shown.act(ended('lemon', LEFT, RIGHT, 3))
    shown.states['lemon'] = RIGHT
    shown.wait(4.8)
    assert not shown.beliefs[-1].stopped
    shown.wait(0.4)
    assert shown.beliefs[-1].stopped
    first, watcher = JointGoals.of(WORLD, MODEL).watch(START), shown.observer.watcher
    assert watcher is None
    for event in (Attempt('lemon', LEFT, RIGHT, Manner.PUSH), Stopped()):
        first.see(event)
    np.testing.assert_allclose(shown.observer.person, first.person)
    shown.act(ended('lemon', RIGHT, LEFT, 12))
    again = library(Attempt('lemon', RIGHT, LEFT, Manner.PUSH), person=first.person, lemon=RIGHT)
    watcher = shown.observer.watcher
    assert watcher is not None
    np.testing.assert_allclose(watcher.posterior, again, rtol=1e-12)


def test_a_late_act_begins_anew_if_no_table_state_came_between() -> None:
    shown = Shown()
    shown.act(ended('lemon', LEFT, LEFT, 3, direction=RIGHT))
    shown.observer.see(ended('pear', LEFT, RIGHT, 20))
    shown.time = 19.9
    shown.wait(0.2)
    assert [b.stopped for b in shown.beliefs] == [False, True, False]
    assert shown.beliefs[-1].events == 1


def test_an_act_that_is_under_way_for_long_has_not_stopped() -> None:
    shown = Shown()
    shown.act(under_way(ended('lemon', LEFT, LEFT, 3)))
    shown.wait(8, settled=False)
    assert not shown.beliefs[-1].stopped
    shown.wait(0.1)  # Nobody is there: its end was lost.
    assert shown.beliefs[-1].stopped


def test_where_nothing_was_seen_nothing_is_known() -> None:
    observer = JointObserver(WORLD, MODEL, JointSettings())
    observer.look(TableSnapshot(SECOND, 'camera', True, {'lemon': LEFT}))
    observer.see(ended('lemon', LEFT, LEFT, 3, direction=RIGHT))
    observer.look(TableSnapshot(3 * SECOND, 'camera', True, {'lemon': LEFT}))
    assert observer.watcher is not None
    unknown = np.full(3, 1 / 3)
    expected = library(IN_VAIN, pear=unknown, chicken=unknown)
    np.testing.assert_array_equal(observer.watcher.posterior, expected)


def test_the_start_is_what_was_seen_before_the_first_act() -> None:
    shown = Shown()
    shown.wait(2.0)
    shown.states['pear'] = RIGHT  # Seen there before its act is told.
    shown.wait(0.1)
    shown.act(ended('lemon', LEFT, RIGHT, 3.9), ended('pear', LEFT, RIGHT, 4))
    assert shown.observer.watcher is not None
    assert shown.observer.watcher.start == (0, 0, 1)


def test_an_attempt_waits_for_its_table_state() -> None:
    shown = Shown()
    assert shown.observer.see(ended('lemon', LEFT, LEFT, 3)) == []
    assert shown.observer.watcher is None
    shown.wait(1.9)
    assert shown.beliefs == []
    shown.wait(0.2)
    assert len(shown.beliefs) == 1


def test_time_that_begins_anew_forgets_the_table_and_not_the_person() -> None:
    shown = Shown()
    shown.act(ended('lemon', LEFT, RIGHT, 30))
    shown.wait(6)
    known = shown.observer.person
    shown.time = 0.0
    shown.wait(0.1)
    assert shown.observer.watcher is None
    assert shown.observer.person is known


def test_what_is_not_sure_or_no_action_is_summed_over() -> None:
    shown = Shown()
    unsure = replace(ended('lemon', LEFT, LEFT, 3, direction=RIGHT), manner_probability=0.7)
    shown.act(unsure, ended('lemon', LEFT, None, 4, manner=Manner.DROP, direction=RIGHT))
    expected = library(
        Attempt('lemon', LEFT, LEFT, direction=RIGHT), Attempt('lemon', LEFT, direction=RIGHT)
    )
    assert shown.observer.watcher is not None
    np.testing.assert_array_equal(shown.observer.watcher.posterior, expected)


def test_soft_states_enter_as_they_are_unless_they_are_not_wanted() -> None:
    soft = replace(ended('lemon', LEFT, LEFT, 3), x_f_probability=(0.8, 0.2, 0.0))
    for wanted, x_f in ((True, [0.8, 0.2, 0.0]), (False, LEFT)):
        shown = Shown(JointSettings(soft_evidence=wanted))
        shown.act(soft)
        assert shown.observer.watcher is not None
        expected = library(Attempt('lemon', LEFT, x_f, Manner.PUSH))
        np.testing.assert_array_equal(shown.observer.watcher.posterior, expected)


def test_fiddling_has_none_of_the_goals_by_the_test_that_is_found_while_idle() -> None:
    shown = Shown()
    shown.wait(SIMULATED / 10)
    begin = shown.time
    acts = [('pear', LEFT, LEFT), ('chicken', RIGHT, RIGHT), ('lemon', LEFT, LEFT),
            ('chicken', RIGHT, RIGHT)]  # fmt: skip
    for k, (name, x, push) in enumerate(acts):
        shown.act(ended(name, x, x, begin + 2 * k + 2, direction=push))
    shown.wait(6)
    assert shown.beliefs[-1].stopped
    assert shown.beliefs[-1].none_of_these
    assert shown.beliefs[-1].sentence == (
        'The person has stopped: I see no goal in what was done.'
    )


@pytest.mark.parametrize(
    ('settings', 'part'),
    [
        (JointSettings(largest=0), 'joint_goals is 0'),
        (JointSettings(largest=62), '3 objects in 3 regions have 63, joint_goals allows 62'),
    ],
)
def test_too_many_goals_are_refused_in_one_sentence(settings: JointSettings, part: str) -> None:
    shown = Shown(settings)
    shown.act(ended('lemon', LEFT, LEFT, 3))
    shown.wait(1)
    assert part in shown.observer.refusal
    assert shown.beliefs == []


def test_a_large_world_costs_nothing() -> None:
    world = load_world('three_bins')
    observer = JointObserver(world, shipped(world), JointSettings())
    observer.look(TableSnapshot(SECOND, 'camera', True, {}))
    assert 'have 3124' in observer.refusal


def test_an_object_of_no_world_is_refused() -> None:
    with pytest.raises(ValueError, match="got 'banana'"):
        Shown().observer.see(ended('banana', LEFT, LEFT, 3))


@pytest.mark.parametrize(
    ('acts', 'begin'),
    [
        ([ended('lemon', LEFT, LEFT, 3, direction=RIGHT)] * 2,
         'The person tried twice to move the lemon to RIGHT, in vain: I believe lemon RIGHT (0.'),
        ([ended('lemon', LEFT, LEFT, 3)], 'The person moved the lemon once, and left it LEFT: '),
        ([ended('lemon', LEFT, RIGHT, 3)], 'The person moved the lemon from LEFT to RIGHT: '),
        ([ended('lemon', LEFT, None, 3, direction=OFFTABLE)],
         'The person moved the lemon to OFFTABLE, and I did not see where it ended: '),
        ([under_way(ended('lemon', LEFT, LEFT, 3, direction=RIGHT))],
         'The person is moving the lemon to RIGHT: I believe lemon RIGHT (0.'),
    ],
)  # fmt: skip
def test_the_sentence(acts: list[ObservedAttempt], begin: str) -> None:
    shown = Shown()
    shown.act(*acts)
    assert shown.beliefs[-1].sentence.startswith(begin)


def test_the_sentence_names_what_need_not_change() -> None:
    shown = Shown()
    shown.act(ended('lemon', LEFT, LEFT, 3, direction=RIGHT))
    shown.act(ended('lemon', LEFT, LEFT, 5, direction=RIGHT))
    shown.wait(6)
    sentence = shown.beliefs[-1].sentence
    assert sentence.startswith('The person has stopped: I believe lemon RIGHT (0.')
    assert sentence.endswith(', and that the pear and the chicken need not change.')


def taken_up(shown: Shown) -> Shown:
    """Another observer, with what the log has of the first one's beliefs."""
    records = [json.loads(to_text(belief_record(belief, WORLD))) for belief in shown.beliefs]
    other = Shown()
    other.observer = JointObserver(WORLD, MODEL, JointSettings())
    other.time, other.states = shown.time, dict(shown.states)
    belief = other.observer.take_up(told_events(records, WORLD))
    other.beliefs = [] if belief is None else [belief]
    return other


def test_another_observer_goes_on() -> None:
    first = Shown()
    first.act(ended('pear', LEFT, RIGHT, 2.0))
    first.wait(7.0)
    first.act(under_way(ended('lemon', LEFT, LEFT, 10.0, direction=RIGHT)))
    first.act(ended('lemon', LEFT, LEFT, 10.0, direction=RIGHT))
    second = taken_up(first)
    assert second.observer.watcher is not None
    for shown in (first, second):
        soft = replace(ended('lemon', LEFT, RIGHT, 13.0), x_f_probability=(0.1, 0.9, 0.0))
        shown.act(soft)
        shown.wait(6.0)
    third = taken_up(first)
    assert third.observer.watcher is None
    for shown in (first, third):
        shown.act(ended('pear', RIGHT, LEFT, 22.0))
    assert (len(second.beliefs), len(third.beliefs)) == (3, 2)
    for here, there in zip(
        (*first.beliefs[3:6], *first.beliefs[5:]), (*second.beliefs, *third.beliefs), strict=True
    ):
        np.testing.assert_array_equal(here.marginals, there.marginals)
        assert (here.p_value, here.start, here.sentence) == (
            there.p_value,
            there.start,
            there.sentence,
        )


def test_what_cannot_be_taken_up() -> None:
    first = Shown()
    first.act(ended('pear', LEFT, RIGHT, 2.0))
    records = [belief_record(belief, WORLD) for belief in first.beliefs]
    old = [{k: v for k, v in record.items() if k != 'attempt'} for record in records]
    assert told_events(old, WORLD) == told_events([], WORLD) == ()
    assert JointObserver(WORLD, MODEL, JointSettings()).take_up(()) is None
    cut = [replace(event, demonstration=1) for event in told_events(records, WORLD)]
    assert JointObserver(WORLD, MODEL, JointSettings()).take_up(cut) is None
    # A person who acted an hour ago does not stop now.
    late = taken_up(first)
    late.time += 3600
    late.wait(10.0)
    assert len(late.beliefs) == 1


def test_beliefs_are_noted_before_what_follows_and_not_in_a_replay(tmp_path: Path) -> None:
    path = tmp_path / 'log.sqlite'
    log = SessionLog(DecisionLog(str(path), lock_timeout=0.05), WORLD, 'cell', 'run', lambda: 0.0)
    here = Shown()
    here.act(ended('pear', LEFT, RIGHT, 2.0))
    here.wait(6.0)
    seen, stopped = here.beliefs
    with closing(sqlite3.connect(path, isolation_level=None)) as other:
        log.believed(seen)
        other.execute('BEGIN IMMEDIATE')
        log.believed(stopped)
    log._again = -1.0
    goal = table_goal(stopped, 5.0)
    assert goal is not None
    log.write(('table_goal', to_json(goal)))
    log.paused = True
    log.believed(seen)
    log.paused = False
    log.poll()
    entries = list(DecisionLog(str(path)).entries(['joint_belief', 'table_goal']))
    assert [entry.kind for entry in entries] == ['joint_belief', 'joint_belief', 'table_goal']
    last = entries[1].data
    assert last['objects'] == list(stopped.objects)
    assert last['start'] == [None if x is None else x.name for x in stopped.start]
    assert last['changes'][0] == [['RIGHT', None, None], stopped.changes[0][1]]
    assert last['marginals'] == stopped.marginals.tolist()
    assert line(entries[0]).endswith(f'{seen.sentence} 1 events, p-value {seen.p_value:.2g}')

"""The screen as text, from values alone."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from likeme_bringup.cell_status import MotionPermission, NodeStatus
from likeme_core.paper_world import WORLD
from likeme_core.world import load_world
from likeme_inference.tabletop.values import Reply
from likeme_operator.action_evidence import ActionEvidence
from likeme_operator.desk_layout import DeskState, desk_lines, too_small
from likeme_operator.desk_problems import problems_of
from likeme_operator.desk_view import (
    ANYWHERE,
    DeskView,
    MadeDecision,
    OpenQuestion,
    QuestionKey,
    SeenObject,
    SeenTable,
    ShownAttempt,
    TableBelief,
)
from likeme_operator.history import History
from likeme_operator.panels import belief_page, option_lines, rule_line
from likeme_operator.table_plan import table_plan
from likeme_operator.text_bars import ago, bar, evidence_bar, short

READY = NodeStatus('ready', version='0.1.0')
NODES = dict.fromkeys(('hold_keeper', 'arm_driver', 'perception_node', 'inference_node'), READY)
PEAR = SeenObject('pear', 'RIGHT', 1.0, 0.33, -0.25, visible=True)
LEMON = SeenObject('lemon', 'LEFT', 0.98, 0.35, 0.21, visible=False)
GONE = SeenObject('chicken', 'UNKNOWN', math.nan, math.nan, math.nan, visible=False)
TABLE = SeenTable((PEAR, LEMON, GONE), 0.04, hand=False, arm=True, settled=True)
ASKS = MadeDecision(
    4, 'pear', 'RIGHT', 'LEFT', 'ASK_HUMAN', 'PUSH_LEFT', 'interactive', 0.5, 0.4, 1,
    goals=(('LEFT', 0.88), ('RIGHT', 0.12), ('OFFTABLE', 0.0)),
    success=(('PUSH_LEFT', 0.4),),
    predicted=(('LEFT', 0.4), ('RIGHT', 0.6), ('OFFTABLE', 0.0)),
    sentence='I ask.',
    evidence=(
        ActionEvidence('PLACE_LEFT', 0.0, 10, 0, 0.0, 0.09),
        ActionEvidence('PUSH_LEFT', 0.4, 10, 4, 0.14, 0.70),
    ),
)  # fmt: skip
QUESTION = OpenQuestion(
    QuestionKey(4, 'pear', 'PUSH_LEFT', 7), 'RIGHT', 'LEFT', 0.4, 0.5, 'May I?', tuple(Reply), 63.0
)


@pytest.fixture
def view() -> DeskView:
    history = History()
    row = {'object': 'pear', 'x_i': 'RIGHT', 'goal': 'LEFT', 'action': 'PUSH_LEFT', 'p': 0.4}
    history.decided('', {'id': 1, 'choice': 'AT_GOAL', **row})
    history.decided('23:19:12', {'id': 2, 'choice': 'ASK_HUMAN', **row})
    history.answered(2, 'TRY_ANYWAY', 'Bob')
    history.ended(2, 'REACHED')
    history.decided('23:20:01', {'id': 4, 'choice': 'ASK_HUMAN', **row})
    return DeskView(
        62, True, WORLD.label, MotionPermission(True), '', tuple(NODES.items()), TABLE, 30.0,
        None, ASKS, (QUESTION,), history.rows,
    )  # fmt: skip


@pytest.mark.parametrize(('width', 'height'), [(80, 24), (81, 25), (120, 40), (200, 60)])
def test_every_size_is_filled_and_none_overflows(view: DeskView, width: int, height: int) -> None:
    state = DeskState(QUESTION, confirming=('A long sentence ' * 20, 'Enter does it'))
    for each in (DeskState(QUESTION), state):
        lines = desk_lines(view, WORLD, each, '12:00:00', width, height)
        assert len(lines) == height
        assert max(map(len, lines)) <= width
        assert lines[-1].endswith('q quit')
    assert too_small(width, height) == ''
    assert too_small(79, 24) == 'Expected a terminal of 80x24 or more, got 79x24.'


def test_what_an_operator_needs_is_there(view: DeskView) -> None:
    text = '\n'.join(desk_lines(view, WORLD, DeskState(QUESTION), '12:00:00', 80, 24))
    for words in (
        'MOTION ALLOWED', '>[1] pear 1:03', 'PEAR', '(lemon)', 'chicken UNKNOWN', 'no hand, arm',
        '>PUSH_LEFT      .40', '4/10  .14-.70', '.40 < threshold .50: ASKS', 'Bob: try',
        'TRY: the robot will PUSH_LEFT the pear: LEFT 0.40, RIGHT 0.60', 'answer question 4, pear',
    ):  # fmt: skip
        assert words in text, words
    assert '#1 ' not in text


def test_while_a_person_acts_the_goals_of_the_table_are_shown(view: DeskView) -> None:
    goals = (('the pear LEFT, the lemon RIGHT, the chicken LEFT', 0.62), ('the pear LEFT', 0.3))
    wanted = (('pear', (('LEFT', 0.92), (ANYWHERE, 0.08))),)
    belief = TableBelief(goals, wanted, False, False, 3, 'I believe it.', age=1.0)
    acts = replace(view, believed=belief)
    text = '\n'.join(desk_lines(acts, WORLD, DeskState(QUESTION), '12:00:00', 80, 24))
    for words in (
        'the person acts (3 so far)',
        'the pear LEFT, the lemon R…',
        '.62',
        '── what is wanted',
    ):
        assert words in text, words
    assert 'ASKS' not in text.partition('── what if')[0]
    attempt = ShownAttempt('pear', 'RIGHT', 'place', 0.9, 'LEFT', '', 0.2)
    for told, words in (
        (attempt, 'now: pear RIGHT>LEFT? place .90'),
        (replace(attempt, manner='', towards=''), 'now: pear RIGHT>?'),
        (replace(attempt, x_f='LEFT'), 'pear RIGHT>LEFT place .90'),
        (replace(attempt, x_f='RIGHT'), 'pear RIGHT>RIGHT (tried LEFT) place .90'),
    ):
        seen = replace(acts, attempted=told)
        lines = desk_lines(seen, WORLD, DeskState(QUESTION), '12:00:00', 80, 24)
        assert words in [line.rpartition('│ ')[2].strip() for line in lines]
    past = desk_lines(acts, WORLD, DeskState(QUESTION, selected=4), '12:00:00', 80, 24)
    assert '.40 < threshold .50: ASKS' in '\n'.join(past)
    for over in (replace(belief, over=True), replace(belief, age=60.0)):
        lines = desk_lines(
            replace(view, believed=over), WORLD, DeskState(QUESTION), '12:00:00', 80, 24
        )
        assert 'why: the newest decision' in '\n'.join(lines)
    assert belief_page(belief)[-1] == '  pear       LEFT 0.92  anywhere 0.08'
    assert belief_page(None) == ['Nobody has moved anything yet.']


def test_what_cannot_work_is_not_offered() -> None:
    hopeless = replace(QUESTION, options=(Reply.DONE_BY_HAND, Reply.SKIP))
    assert [line[0] for line in option_lines(hopeless, None)] == ['d', 's']


def test_why_it_acts_or_asks() -> None:
    acts = replace(ASKS, kind='EXECUTE', threshold=0.4)
    assert rule_line(acts) == '.40 >= threshold .40: ACTS'
    assert rule_line(replace(acts, mode='goal_based')) == 'goal_based never asks: ACTS'
    several = replace(acts, mode='sequential', sure=0.78, actions_left=3)
    assert rule_line(several) == '.78 in 3 actions >= threshold .40: ACTS'


def test_problems_say_what_follows() -> None:
    dead = {**NODES, 'inference_node': NodeStatus('silent', 'not heard for 1 s')}
    allowed = MotionPermission(True)
    assert problems_of(True, NODES, allowed, TABLE) == ()
    assert problems_of(True, dead, allowed, TABLE) == (
        'inference_node is silent, nothing is decided, and no answer is taken.',
    )
    assert problems_of(True, NODES, MotionPermission(False, 'held by Ada'), TABLE) == ()
    assert 'start_cell.sh' in problems_of(False, {}, allowed, None)[0]
    old = replace(TABLE, age=3.2)
    assert problems_of(True, NODES, allowed, old) == ('The picture is 3 s old.',)
    dark = replace(TABLE, reason='image too dark')
    assert problems_of(True, NODES, allowed, dark) == (
        'The camera tells nothing: image too dark.',
    )


@pytest.mark.parametrize('name', ['chunG2015'.lower(), 'three_bins', 'one_more_manner'])
def test_any_world_is_drawn(name: str) -> None:
    world = load_world(name)
    place = world.regions.areas[0]
    assert place is not None
    x, y = place.centre
    thing = SeenObject('thing', world.states[0].name, 1.0, x, y, visible=True)
    plan = table_plan(world, [thing], 40, 10, 'thing')
    assert len(plan) == 10
    assert {len(line) for line in plan} == {40}
    text = '\n'.join(plan)
    assert 'THING' in text
    for state, area in zip(world.states, world.regions.areas, strict=True):
        assert area is None or state.name[:4] in text


def test_names_in_one_place_do_not_cover_each_other() -> None:
    there = [replace(PEAR, name=name) for name in ('pear', 'lemon', 'chicken')]
    text = '\n'.join(table_plan(WORLD, there, 34, 8))
    assert all(name in text for name in ('pear', 'lemon', 'chicken'))


def test_bars_and_numbers() -> None:
    assert [short(p) for p in (0.4, 1.0, 0.0, math.nan)] == [' .40', ' 1.0', ' .00', '  - ']
    assert bar(0.5, 4) == '██··'
    assert evidence_bar(0.4, 0.14, 0.7, 10, 0.5) == '████▒|▒···'
    assert [ago(63), ago(3723)] == ['1:03', '1:02:03']

"""Model files: round trip, several sources, and every way to be wrong with its line."""

from __future__ import annotations

import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from likeme_core.paper_world import LEFT, PUSH_LEFT, PUSH_RIGHT, WORLD
from likeme_core.tabletop import Mode
from likeme_inference.tabletop.action_selection import Kind, choose
from likeme_inference.tabletop.domain import TABLETOP
from likeme_inference.tabletop.imitation import ImitationSettings, model_gaps
from likeme_inference.tabletop.model_file import (
    format_model,
    load,
    load_tabletop,
    save,
    shipped,
)
from likeme_inference.tabletop.model_parser import ModelFileError, parse
from likeme_inference.tabletop.prior import Prior
from likeme_inference.tabletop.robot_model import RobotModel, TrialCounts

GOOD = """\
likeme_transition_model,1
# a comment

name,tiny
version,7
source,a,"Made up, for a test"
source,b,Another
states,LEFT,RIGHT,OFFTABLE
actions,PLACE_LEFT,PLACE_RIGHT,PLACE_OFFTABLE,PUSH_LEFT,PUSH_RIGHT,PUSH_OFFTABLE
object,x_i,action,LEFT,RIGHT,OFFTABLE,source
pear,LEFT,PUSH_RIGHT,1,8,1,a
pear,LEFT,PUSH_RIGHT,0,2,0,b
end,2,12
"""


def test_counts_of_several_sources_add_up() -> None:
    model = parse(GOOD)

    assert model.label == 'tiny 7'
    assert model.objects['pear'].counts[LEFT, PUSH_RIGHT].tolist() == [1, 10, 1]
    assert model.sources['a'] == 'Made up, for a test'
    assert model.objects['pear'].trials == 12


@pytest.mark.parametrize('model', [shipped(), parse(GOOD)], ids=lambda model: model.name)
def test_round_trip(model: RobotModel, tmp_path: Path) -> None:
    save(model, tmp_path / 'model.csv')

    assert load(tmp_path / 'model.csv') == model
    assert [path.name for path in tmp_path.iterdir()] == ['model.csv']


KITCHEN = """\
likeme_transition_model,1
name,kitchen
version,1
source,a,A cook
states,board,pan,plate,floor
actions,lift,tip
goal,served,plate
goal,indoors,board,pan,plate
aim,tip,served
out_of_reach,floor
object,x_i,action,board,pan,plate,floor,source
egg,pan,tip,0,1,7,2,a
end,1,10
"""


def test_models_of_other_domains(tmp_path: Path) -> None:
    kitchen = parse(KITCHEN)
    save(kitchen, tmp_path / 'kitchen.csv')

    assert load(tmp_path / 'kitchen.csv') == kitchen
    assert kitchen.domain.shape == (4, 2, 4)
    assert kitchen.domain.goal_matrix.tolist() == [[0, 0, 1, 0], [1, 1, 1, 0]]
    assert (kitchen.domain.stuck.tolist(), kitchen.domain.aimed) == (
        [False] * 3 + [True],
        ((1,), ()),
    )
    pan, tip = kitchen.domain.state('pan'), kitchen.domain.action('tip')
    egg = kitchen.goal_model('egg')
    assert egg.success(pan, kitchen.domain.goal('served')).tolist() == [0.25, 0.7]
    made = choose(egg, pan, 0, None, Mode.INTERACTIVE, 0.5)
    assert (made.kind, made.action, made.predicted_success) == (Kind.EXECUTE, tip, 0.7)
    fallen = choose(egg, 3, 0, None, Mode.SEQUENTIAL, 0.5, 3)
    assert (fallen.kind, fallen.plan_value) == (Kind.ASK_HUMAN, 0)
    assert choose(egg, 0, 1, None, Mode.GOAL_BASED, 0.5).kind is Kind.AT_GOAL


@pytest.mark.parametrize(
    ('text', 'message'),
    [
        (
            KITCHEN,
            r'a model of the world chung2015, with the states LEFT, .* '
            r'got kitchen 1 with board, pan, plate, floor',
        ),
        (
            GOOD.replace('object,x_i', 'goal,TIDY,LEFT\nobject,x_i'),
            'the lines goal, aim and out_of_reach of the world chung2015',
        ),
        (
            GOOD.partition('pear')[0] + 'end,0,0',
            r'at least one object of the world chung2015 \(pear, lemon, chicken\), got none',
        ),
        (GOOD.replace('pear', 'plum'), r'of the world chung2015 \(.*\), got plum'),
    ],
)
def test_other_domains_are_not_loaded_as_the_tabletop(
    text: str, message: str, tmp_path: Path
) -> None:
    (tmp_path / 'other.csv').write_text(text)

    with pytest.raises(ModelFileError, match=message):
        load_tabletop(tmp_path / 'other.csv', WORLD)


def test_tabletop_files_may_repeat_the_tabletop_lines(tmp_path: Path) -> None:
    said = ''.join(f'goal,{state},{state}\n' for state in TABLETOP.states)
    said += ''.join(f'aim,{action},{goal}\n' for action, goal in TABLETOP.aims.items())
    text = GOOD.replace('object,x_i', f'{said}out_of_reach,OFFTABLE\nobject,x_i')
    (tmp_path / 'model.csv').write_text(text)

    assert load_tabletop(tmp_path / 'model.csv', WORLD) == parse(GOOD)
    swapped = text.replace('goal,LEFT,LEFT\ngoal,RIGHT,RIGHT', 'goal,RIGHT,RIGHT\ngoal,LEFT,LEFT')
    assert parse(swapped).domain != TABLETOP


def test_the_shipped_model_names_its_source() -> None:
    assert 'mjyc/chung2015plosone_robot_data' in shipped().sources['paper']
    assert '10.1371/journal.pone.0141965' in shipped().sources['paper']
    assert {row.source for row in shipped().rows} == {'paper'}


@pytest.mark.parametrize(
    ('old', 'new', 'message'),
    [
        ('model,1', 'model,2', r"line 1: expected 'likeme_transition_model,1', got '.*,2'"),
        ('name,tiny\n', '', "line 4: expected 'name,...', got 'version,7'"),
        ('version,7', 'version,', "line 5: expected 'version,...'"),
        ('source,b', 'source,a', "line 7: expected each source once, got 'a' again"),
        ('source,b,Another', 'source,b', 'line 7: expected "source,KEY,SENTENCE"'),
        ('LEFT,RIGHT,OFFTABLE\nact', 'RIGHT,LEFT,OFFTABLE\nact', "line 10: expected 'object"),
        ('states,LEFT', 'state,LEFT', "line 8: expected 'states,NAME,...'"),
        ('states,LEFT', 'states,RIGHT', 'line 8: expected states with a name each'),
        ('actions,', '', "line 9: expected 'actions,NAME,...', got 'PLACE_LEFT"),
        ('PUSH_RIGHT,PUSH_OFFTABLE', 'PUSH_OFFTABLE', "line 11: expected one of .* 'PUSH_RIGHT'"),
        ('object,x_i', 'goal,TIDY\nobject,x_i', 'line 10: expected "goal,NAME,STATE,..."'),
        ('object,x_i', 'goal,TIDY,UP\nobject,x_i', "line 10: expected one of the states .*'UP'"),
        ('object,x_i', 'aim,PULL,LEFT\nobject,x_i', "line 10: expected one of the act.*'PULL'"),
        ('object,x_i', 'x_i,object', "line 10: expected 'object,x_i"),
        ('pear,LEFT,PUSH_RIGHT,1', 'pear,UP,PUSH_RIGHT,1', "line 11: expected one of .*'UP'"),
        ('PUSH_RIGHT,1,8', 'PULL,1,8', "line 11: expected one of the actions .*'PULL'"),
        ('1,8,1,a', '1,-8,1,a', "line 11: expected whole counts of 0 or more, got '1,-8,1'"),
        ('1,8,1,a', '1,0.8,1,a', "line 11: expected whole counts of 0 or more, got '1,0.8,1'"),
        ('1,8,1,a', '1,nan,1,a', 'line 11: expected whole counts'),
        ('1,8,1,a', f'1,{10**30},1,a', 'line 11: expected whole counts'),
        ('1,8,1,a', '1,8,a', "line 11: expected 7 fields, got 'pear,LEFT,PUSH_RIGHT,1,8,a'"),
        ('1,8,1,a', '1,8,1,c', r"line 11: expected one of the sources \['a', 'b'\], got 'c'"),
        ('0,2,0,b', '0,2,0,a', 'line 12: expected each row once, got that of line 11 again'),
        ('end,2,12\n', '', 'line 13: expected a row or "end,ROWS,TRIALS", but the file stops'),
        ('end,2,12', 'end,2,13', "line 13: expected 'end,2,12', got 'end,2,13'"),
        ('end,2,12\n', 'end,2,12\npear\n', "line 14: expected the end of the file, got 'pear'"),
        ('end,2,12\n', 'end,2,12\n(end of file)\n', 'line 14: expected the end of the file'),
        ('"Made up', '"Made" up', 'line 6: '),
        ('Another', 'An\x07other', 'line 7: expected text without control characters'),
    ],
)  # fmt: skip
def test_wrong_files_are_refused_with_line_and_reason(old: str, new: str, message: str) -> None:
    assert old in GOOD

    with pytest.raises(ModelFileError, match=message):
        parse(GOOD.replace(old, new, 1))


@pytest.mark.parametrize(
    'name', ['', ' pear', '#pear', 'end', 'a\nb', 'a\u2028b', 'a\x07', '\ud800']
)
def test_models_a_file_cannot_represent_are_not_written(name: str, tmp_path: Path) -> None:
    row = TrialCounts(name, LEFT, PUSH_LEFT, (1, 0, 0), 'a')

    with pytest.raises(ModelFileError, match='expected a source, and names of one line'):
        save(RobotModel('m', '1', {'a': 'A'}, (row,)), tmp_path / 'model.csv')
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize('name', ['a,b', 'a "b"', 'ü', 'end.', 'p#', '1'])
def test_names_with_special_characters(name: str) -> None:
    row = TrialCounts(name, LEFT, PUSH_LEFT, (10**15 - 1, 0, 0), 'a')
    model = RobotModel(name, name, {'a': name}, (row,))

    assert parse(format_model(model)) == model
    assert pickle.loads(pickle.dumps(model)) == model


def test_crlf_line_ends() -> None:
    assert parse(GOOD.replace('\n', '\r\n')) == parse(GOOD)


def test_truncated_files_are_rejected() -> None:
    lines = format_model(shipped()).splitlines(keepends=True)

    for n in range(len(lines)):
        with pytest.raises(ModelFileError, match=f'line {n + 1}: '):
            parse(''.join(lines[:n]))


@pytest.mark.parametrize('text', ['', '\n\n', '{}', '\x00', 'likeme_transition_model,1'])
def test_other_texts_are_rejected(text: str) -> None:
    with pytest.raises(ModelFileError, match='line '):
        parse(text)


def test_errors_name_the_file(tmp_path: Path) -> None:
    with pytest.raises(ModelFileError, match=r'no_such_file.csv: No such file'):
        load(tmp_path / 'no_such_file.csv')
    (tmp_path / 'marked.csv').write_text(GOOD, encoding='utf-8-sig')
    assert load(tmp_path / 'marked.csv') == parse(GOOD)
    binary = tmp_path / 'binary.csv'
    binary.write_bytes(b'\x93NUMPY\xff')
    with pytest.raises(ModelFileError, match='expected UTF-8 text'):
        load(binary)


def test_models_in_memory_are_validated() -> None:
    row = TrialCounts('pear', LEFT, PUSH_LEFT, (1, 0, 0), 'a')

    with pytest.raises(ValueError, match='each row once, got 2'):
        RobotModel('m', '1', {'a': 'A'}, (row, row))
    with pytest.raises(ValueError, match=r"sources \['b'\], got 'a'"):
        RobotModel('m', '1', {'b': 'B'}, (row,))
    for wrong, message in [
        (row._replace(counts=(5,)), r'3 whole counts of 0 or more, got \(5,\)'),
        (row._replace(counts=(-1, 5, 0)), '3 whole counts of 0 or more, got'),
        (row._replace(x_i=-1), 'x_i from 0 to 2, got -1'),
        (row._replace(action=6), 'action from 0 to 5, got 6'),
    ]:
        with pytest.raises(ValueError, match=message):
            RobotModel('m', '1', {'a': 'A'}, (wrong,))
    with pytest.raises(ValueError, match=r"objects \['pear'\], got 'plum'"):
        RobotModel('m', '1', {'a': 'A'}, (row,)).model_of('plum')


def test_a_shipped_model_is_not_taken_for_a_changed_world_of_the_same_name() -> None:
    with pytest.raises(
        ModelFileError, match=r'expected a model of the world chung2015, .* got chung2015_robot 1 '
    ):
        shipped(replace(WORLD, actions=WORLD.actions[:5]))
    left, right, off = WORLD.region_entries
    moved = replace(WORLD, region_entries=(replace(left, area=right.area), right, off))
    with pytest.raises(ModelFileError, match='regions of the shipped world chung2015'):
        shipped(moved)


def test_objects_that_the_world_lacks_are_left_out_and_named() -> None:
    known = shipped(WORLD.only('pear'))
    assert list(known.objects) == ['pear']
    assert known.left_out == ('lemon', 'chicken')
    assert np.array_equal(known.model_of('pear').counts, shipped().model_of('pear').counts)
    # The prior that objects share is that of the world's objects alone.
    assert not np.array_equal(
        known.counted('pear', prior=Prior.SHARED).pseudo_counts,
        shipped().counted('pear', prior=Prior.SHARED).pseudo_counts,
    )
    assert shipped(WORLD).left_out == ()


def test_objects_that_model_or_world_lacks_are_named() -> None:
    with_lemon = WORLD.only('pear', 'lemon')
    known = shipped(with_lemon).only(['lemon'])
    settings = ImitationSettings(world=with_lemon)
    assert model_gaps(shipped(), ImitationSettings()) == []
    assert model_gaps(known, settings)[0] == (
        'chung2015_robot 1 has no trials of pear: not imitated, as no prior is set '
        '(concentration or prior).'
    )
    assert model_gaps(known, replace(settings, prior=Prior.SHARED))[0] == (
        'chung2015_robot 1 has no trials of pear: inferred by the prior alone.'
    )
    assert model_gaps(shipped(with_lemon), settings) == [
        'chung2015_robot 1 has trials of chicken, which the world chung2015 lacks: not used.'
    ]


def test_an_untried_object_has_the_prior_fitted_to_the_others() -> None:
    others = shipped().only(['lemon', 'chicken'])
    untried = others.counted('pear', prior=Prior.SHARED)
    assert untried.trials == 0
    # In the prior of an object tried without a trial, nothing but its own counts is missing.
    row = TrialCounts('pear', LEFT, PUSH_LEFT, (0, 0, 0), 'paper')
    empty = RobotModel('m', '1', others.sources, (*others.rows, row))
    assert np.array_equal(untried.prior, empty.counted('pear', prior=Prior.SHARED).prior)
    assert others.counted('pear', 0.5).transition == pytest.approx(1 / 3)
    with pytest.raises(ValueError, match=r"objects \['lemon', 'chicken'\], got 'pear'"):
        others.counted('pear')

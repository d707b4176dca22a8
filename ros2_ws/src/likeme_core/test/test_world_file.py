"""World files: values, digest, and what is refused."""

from __future__ import annotations

import json
import pickle
import re
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
import yaml

from likeme_core.tabletop import Manner
from likeme_core.world import WorldFileError, load_world, shipped_worlds
from likeme_core.world.file import parse_world, world_path
from likeme_core.world.schema_problems import schema
from worlds_parts.random_worlds import broken, random_world

HERE = Path('w.yaml')


def parse(data: Any) -> Any:
    return parse_world(yaml.safe_dump(data, sort_keys=False), HERE)


def test_the_default_world_is_the_papers() -> None:
    world = load_world()
    assert [s.name for s in world.states] == ['LEFT', 'RIGHT', 'OFFTABLE']
    assert [int(s) for s in world.states] == [0, 1, 2]
    assert [a.name for a in world.actions] == [
        'PLACE_LEFT', 'PLACE_RIGHT', 'PLACE_OFFTABLE', 'PUSH_LEFT', 'PUSH_RIGHT', 'PUSH_OFFTABLE',
    ]  # fmt: skip
    assert world.objects == ('pear', 'lemon', 'chicken')
    assert world.out_of_reach == {world.state('OFFTABLE')}
    assert world.action_of(Manner.PUSH, world.state('left')) == 3
    assert world.action_of(Manner.DROP, world.state('left')) is None


def test_states_and_actions_index_arrays_and_keep_their_names() -> None:
    world = load_world()
    action = world.action('push_left')
    assert np.arange(10)[action] == 3
    assert f'{action} {action.target!r}' == 'PUSH_LEFT LEFT'
    assert json.dumps({'a': action}) == '{"a": 3}'
    again = pickle.loads(pickle.dumps(action))
    assert (again, again.name, again.target.name) == (3, 'PUSH_LEFT', 'LEFT')


@pytest.mark.parametrize('value', ['UP', '', 3, -1, True, 'LEFT '])
def test_another_state_is_refused_with_the_names(value: int | str) -> None:
    expected = re.escape(f'(left, right, offtable), got {value!r}')
    with pytest.raises(ValueError, match=expected):
        load_world().state(value)


def test_the_digest_is_of_what_the_numbers_mean() -> None:
    data = random_world(3)
    label = parse(data).label
    data['description'] = 'The same in other words.'
    data['objects'][0]['simulation']['mass'] = 0.1
    assert parse(data).label == label
    data['regions'] = data['regions'][::-1]
    assert parse(data).label != label


@pytest.mark.parametrize('name', shipped_worlds())
def test_shipped_worlds_fit_their_schema(name: str) -> None:
    jsonschema.Draft202012Validator.check_schema(schema())
    jsonschema.validate(yaml.safe_load(world_path(name).read_text()), schema())
    assert load_world(name).name == name


@pytest.mark.parametrize('first', range(0, 200, 50))
def test_random_worlds_are_read(first: int) -> None:
    for seed in range(first, first + 50):
        data = random_world(seed)
        world = parse(data)
        assert [s.name for s in world.states] == [r['name'] for r in data['regions']]
        for entry in world.region_entries:
            if entry.area is not None:
                assert entry.area.contains(*entry.place)
                assert world.regions.state_of(*entry.start.centre) == entry.state
        assert world.regions.state_of(0.0, 1.0) == world.regions.elsewhere


@pytest.mark.parametrize('first', range(0, 500, 100))
def test_broken_worlds_are_refused_with_line_expected_and_got(first: int) -> None:
    for seed in range(first, first + 100):
        data, _kind = broken(random_world(seed), np.random.default_rng(seed))
        text = yaml.safe_dump(data, sort_keys=False)
        with pytest.raises(WorldFileError) as caught:
            parse_world(text, HERE)
        assert re.match(r'w\.yaml:\d+: Expected ', str(caught.value))
        assert '\n' not in str(caught.value)
        for line, message in caught.value.problems:
            assert re.fullmatch(r'Expected .+, got .+\.', message, re.DOTALL), message
            assert 1 <= line <= text.count('\n') + 1


@pytest.mark.parametrize(
    ('text', 'line', 'said'),
    [
        ('', 1, 'got an empty file'),
        ('world: 1\nname: [a\n', 3, 'Expected YAML'),
        ('world: 1\nworld: 1\n', 2, "each key once, got 'world' again"),
        ('- 1\n', 1, 'the file as a mapping, got a list of 1'),
        ('world: 2\n', 1, 'world as 1, got 2'),
        ('a: &a\n  b: *a\n', 1, 'an alias within itself'),
        ('world: 1\nname: OFF\nmass: 1e-3\n', 3, "got 'mass'"),
        ('\x00', 1, 'Expected YAML'),
    ],
)
def test_texts_that_are_no_world(text: str, line: int, said: str) -> None:
    with pytest.raises(WorldFileError) as caught:
        parse_world(text, HERE)
    assert any(p.line == line and said in p.message for p in caught.value.problems), caught.value


def test_the_line_is_that_of_the_value() -> None:
    text = world_path('chung2015').read_text().replace('target: OFFTABLE', 'target: OFF', 1)
    number = next(i for i, line in enumerate(text.splitlines(), 1) if line.endswith('OFF}'))
    with pytest.raises(WorldFileError) as caught:
        parse_world(text, world_path('chung2015'))
    assert [p.line for p in caught.value.problems] == [number]
    assert "Expected target as one of LEFT, RIGHT, OFFTABLE, got 'OFF'." in str(caught.value)


def test_an_unknown_world_is_refused_with_the_shipped_names() -> None:
    with pytest.raises(ValueError, match=r"name \(chung2015.*got 'moon'"):
        load_world('moon')

"""The robot's name follows from numbers: not from names of classes or the order of fields."""

from __future__ import annotations

import copy
from collections.abc import Iterator
from dataclasses import dataclass, fields, make_dataclass, replace
from typing import Any

import pytest

from likeme_arm_sim.cell import CellSettings
from likeme_core.paper_world import WORLD
from likeme_experiments.learning.robot_identity import (
    canonical,
    digest_of,
    robot_document,
    simulated_robot,
)
from likeme_perception.config import PerceptionConfig


@dataclass(frozen=True)
class Sample:
    reach: float = 0.6
    sides: tuple[str, ...] = ('far',)


def leaves(node: Any) -> Iterator[tuple[Any, Any]]:
    """Every container and key that holds a number."""
    for key, value in node.items() if isinstance(node, dict) else enumerate(node):
        if isinstance(value, float):
            yield node, key
        elif isinstance(value, (dict, list)):
            yield from leaves(value)


def test_the_robot_of_the_last_release_keeps_its_name() -> None:
    """Stores are read by this name: see RECORDED_NAMES before changing this test."""
    assert simulated_robot(WORLD) == 'sim-83d81ca7'


def test_classes_may_be_renamed_and_fields_reordered() -> None:
    other = make_dataclass('Renamed', [('sides', tuple[str, ...]), ('reach', float)], frozen=True)
    assert digest_of({'arm': canonical(other(('far',), 0.6))}) == digest_of(
        {'arm': canonical(Sample())}
    )


def test_equal_numbers_of_different_types_are_the_same() -> None:
    assert digest_of(canonical({'a': 1, 'b': (0,)})) == digest_of(
        canonical({'b': [0.0], 'a': 1.0})
    )


def test_every_number_is_part_of_the_name() -> None:
    document = robot_document(WORLD)
    digests = {digest_of(document)}
    count = len(list(leaves(document)))
    for index in range(count):
        changed = copy.deepcopy(document)
        node, key = list(leaves(changed))[index]
        node[key] += 1e-6
        digests.add(digest_of(changed))
    assert count > 100
    assert len(digests) == count + 1


def test_the_document_holds_world_cell_and_perception() -> None:
    document = robot_document(WORLD)
    assert len(document['world']['objects']) == len(WORLD.objects)
    assert document['perception'].keys() == {f.name for f in fields(PerceptionConfig)}
    faster = replace(CellSettings(initial_states={}), arm_speed=2.0)
    assert canonical(faster) != document['cell']


def test_what_is_not_a_number_is_refused() -> None:
    with pytest.raises(TypeError, match='Expected numbers, strings and None, got object'):
        canonical({'mesh': object()})

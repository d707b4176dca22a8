"""Random worlds through the simulated cell: seen, inferred, decided and acted, without a node."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import yaml
from random_worlds import random_world

from likeme_bringup.simulated_looks import simulated_looks
from likeme_core.outcomes import MotionOutcome
from likeme_core.tabletop import Manner, Mode
from likeme_core.world import World
from likeme_core.world.file import parse_world
from likeme_experiments.imitation.demonstration import (
    background_of,
    human_action,
    new_perception,
    temporary_cell,
)
from likeme_experiments.imitation.imitation_cell import ImitationCell
from likeme_inference.tabletop.action_selection import Kind
from likeme_inference.tabletop.domain import domain_of
from likeme_inference.tabletop.imitation import ImitationSettings, decide
from likeme_inference.tabletop.robot_model import RobotModel, TrialCounts
from likeme_perception.catalogue import object_yaml

pytestmark = pytest.mark.slow
NAME = 'thing_0'


def world_of(data: dict[str, Any]) -> World:
    return parse_world(yaml.safe_dump(data, sort_keys=False), Path('random.yaml'))


def with_one_object(seed: int) -> World:
    """A random world with its first object, which looks as the simulated camera sees it."""
    data = random_world(seed)
    data['objects'] = data['objects'][:1]
    (entry,) = yaml.safe_load(object_yaml(simulated_looks(world_of(data), NAME)))
    data['objects'][0]['looks'] = entry['looks']
    return world_of(data)


def never_slips(world: World) -> RobotModel:
    """A model by which every action ended ten times where it aims."""
    rows = [
        TrialCounts(NAME, x_i, action, tuple(10 * (x == action.target) for x in world.states), 's')
        for x_i in world.states
        for action in world.actions
    ]
    return RobotModel('certain', '1', {'s': 'made up'}, tuple(rows), domain_of(world))


@pytest.mark.parametrize('seed', [0, 2, 5, 13])
def test_a_random_world_is_seen_inferred_and_acted_in(seed: int) -> None:
    world = with_one_object(seed)
    on_table = [state for state in world.states if state != world.regions.elsewhere]
    shown = next(a for a in world.actions if a.manner is Manner.PLACE and a.target in on_table)
    x_i = next(state for state in on_table if state != shown.target)
    with temporary_cell(world, NAME) as cell:
        cell.restart(seed)
        cell.reset([NAME], [x_i], seed)
        perception = new_perception(world, cell, background_of(world, NAME))
        (demo,) = human_action(cell, perception, NAME, shown)
    assert (demo.object, demo.x_i, demo.x_f, demo.manner) == (
        NAME,
        x_i,
        shown.target,
        Manner.PLACE,
    )

    with temporary_cell(world, NAME) as cell:
        turn = ImitationCell(world, cell, NAME, x_i, seed)
        settings = ImitationSettings(world=world, mode=Mode.INTERACTIVE)
        decision = decide(never_slips(world), settings, demo, turn.start, 1)
        assert (decision.kind, decision.goal) == (Kind.EXECUTE, shown.target)
        assert decision.action is not None
        assert decision.action.target == shown.target
        acted = turn.execute((), decision.action)
    # The simulated arm may fail, but then it says so and the camera sees the object where it was.
    reached = acted.report.outcome is MotionOutcome.COMPLETED
    assert acted.view.states[NAME] == (decision.goal if reached else x_i)

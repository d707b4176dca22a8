"""One random world from its file to a decision and an act, without a node."""

from __future__ import annotations

import json
import time
import traceback
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import yaml

from likeme_arm_sim.cell import Cell, CellSettings
from likeme_bringup.simulated_looks import simulated_looks
from likeme_core.observations import Demonstration
from likeme_core.outcomes import MotionOutcome
from likeme_core.tabletop import Action, Mode, State
from likeme_core.world import World
from likeme_core.world.file import parse_world
from likeme_experiments.imitation.demonstration import (
    background_of,
    human_action,
    new_perception,
    temporary_cell,
)
from likeme_experiments.imitation.imitation_cell import ImitationCell
from likeme_inference.tabletop.domain import domain_of
from likeme_inference.tabletop.imitation import ImitationSettings, decide
from likeme_inference.tabletop.model_file import format_model
from likeme_inference.tabletop.model_parser import parse
from likeme_inference.tabletop.robot_model import RobotModel, TrialCounts
from likeme_perception.catalogue import object_yaml
from worlds_parts.random_worlds import random_world

#: RGB of the objects: distinct from each other, from skin, table and arm.
PAINTS = (
    (120, 170, 30), (235, 200, 30), (170, 40, 40), (30, 70, 190), (190, 60, 190), (20, 170, 130),
    (40, 40, 45),
)  # fmt: skip


class WorldRun(NamedTuple):
    """What happened in one world.

    Attributes:
        failure: the traceback of a crash; empty: none.
        seen, objects: objects whose state the camera reported right, of all.
        understood: whether a person's act was reported with object, states and manner; None: the
            world has no action that a person can show.
        consistent: whether the decision is the one that follows from a model without failures.
        moved, reached: whether the robot acted, and whether the object came to the goal.
        told: the report of the arm, if it was not reached.
    """

    seed: int
    seconds: float = 0.0
    failure: str = ''
    regions: int = 0
    actions: int = 0
    objects: int = 0
    seen: int = 0
    understood: bool | None = None
    consistent: bool = False
    moved: bool = False
    reached: bool = False
    told: str = ''


def run_world(seed: int, count: int | None = None) -> WorldRun:
    """Run one world with its first `count` objects (None: all); a crash is a result."""
    begin = time.monotonic()
    try:
        run = _run(seed, count)
    except Exception:  # What crashes is what is looked for.
        run = WorldRun(seed, failure=traceback.format_exc())
    return run._replace(seconds=time.monotonic() - begin)


def random_simulated_world(seed: int, count: int | None = None) -> World:
    """A random world whose objects look as the simulated camera sees them.

    count: of objects, the first ones; None: all.
    """
    data = random_world(seed)
    data['objects'] = data['objects'][:count]
    for entry, paint in zip(data['objects'], PAINTS, strict=False):
        (part,) = entry['simulation']['parts']
        part['colour'] = list(paint)
        entry['looks'] = _looks(json.dumps(part), seed)
    return _parsed(data)


_measured: dict[str, Any] = {}


def _looks(part: str, seed: int) -> Any:
    """What the camera sees of an object of one part, JSON; measured once in a process.

    All random worlds have the same table and camera.
    """
    if part not in _measured:
        data = random_world(seed)
        data['objects'] = data['objects'][:1]
        data['objects'][0]['simulation']['parts'] = [json.loads(part)]
        looks = simulated_looks(_parsed(data), data['objects'][0]['name'])
        (entry,) = yaml.safe_load(object_yaml(looks))
        _measured[part] = entry['looks']
    return _measured[part]


def never_fails(world: World) -> RobotModel:
    """A model by which every action ended ten times where it aims, read from its own file."""
    rows = tuple(
        TrialCounts(name, x_i, action, tuple(10 * (x == action.target) for x in world.states), 's')
        for name in world.objects
        for x_i in world.states
        for action in world.actions
    )
    model = RobotModel('certain', '1', {'s': 'made up'}, rows, domain_of(world))
    return parse(format_model(model))


def _parsed(data: dict[str, Any]) -> World:
    return parse_world(yaml.safe_dump(data, sort_keys=False), Path('random.yaml'))


def _run(seed: int, count: int | None) -> WorldRun:
    world = random_simulated_world(seed, count)
    model, name = never_fails(world), world.objects[0]
    run = WorldRun(
        seed,
        regions=len(world.states),
        actions=len(world.actions),
        objects=len(world.objects),
        seen=_states_seen(world, seed),
    )
    shown, x_i = _act_of(world)
    if shown is None:
        shown, x_i = world.actions[0], next(x for x in world.states if x not in world.out_of_reach)
        demo = _made_up(name, shown, x_i)
    else:
        found = _demonstrated(world, name, shown, x_i, seed)
        expected = name, x_i, shown.target, shown.manner
        run = run._replace(
            understood=[(d.object, d.x_i, d.x_f, d.manner) for d in found] == [expected]
        )
        demo = found[0] if run.understood else _made_up(name, shown, x_i)
    with temporary_cell(world, name) as cell:
        turn = ImitationCell(world, cell, name, x_i, seed)
        settings = ImitationSettings(world=world, mode=Mode.GOAL_BASED)
        decision = decide(model, settings, demo, turn.start, 1)
        run = run._replace(
            consistent=decision.goal == shown.target
            and (decision.action is None or decision.action.target == shown.target)
        )
        acted = turn.execute((), shown if decision.action is None else decision.action)
    outcome = acted.report.outcome
    reached = acted.view.states.get(name) == shown.target
    return run._replace(
        moved=outcome is MotionOutcome.COMPLETED,
        reached=reached,
        told='' if reached else acted.report.message,
    )


def _states_seen(world: World, seed: int) -> int:
    """Of how many objects the camera reports the true state, all of them in their start states."""
    cell = Cell(world, seed, CellSettings())
    perception = new_perception(world, cell, None)
    perception.learn_background()
    table = perception.wait_until_settled()
    true = cell.true_states()
    cell.physics_world.client.disconnect()
    return sum(table.object(name).state == true[name].state for name in world.objects)


def _act_of(world: World) -> tuple[Action | None, State]:
    """An action that a person can show, and the state it starts from; None: there is none."""
    reachable = [state for state in world.states if state not in world.out_of_reach]
    for action in world.actions:
        starts = [state for state in reachable if state != action.target]
        if action.target in reachable and starts:
            return action, starts[0]
    return None, reachable[0]


def _demonstrated(
    world: World, name: str, shown: Action, x_i: State, seed: int
) -> tuple[Demonstration, ...]:
    with temporary_cell(world, name) as cell:
        cell.restart(seed)
        cell.reset([name], [x_i], seed)
        perception = new_perception(world, cell, background_of(world, name))
        return human_action(cell, perception, name, shown)


def _made_up(name: str, shown: Action, x_i: State) -> Demonstration:
    return Demonstration(
        1, 'camera', name, x_i, shown.target, shown.manner, 0, 1, rise=float(np.nan)
    )

"""All that a decision follows from, as JSON: from it the decision can be made again."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Any, NamedTuple

from likeme_core.observations import Demonstration, TableSnapshot
from likeme_core.tabletop import Action, Manner, Mode, State
from likeme_core.world import World, load_world
from likeme_inference.tabletop.action_selection import Kind
from likeme_inference.tabletop.domain import Policy, domain_of
from likeme_inference.tabletop.imitation import ImitationSettings, can_infer, decide, no_trials
from likeme_inference.tabletop.robot_model import RobotModel, TrialCounts
from likeme_inference.tabletop.session import ImitationSession
from likeme_inference.tabletop.values import Decision
from likeme_inference.value_json import from_json, to_json

#: Relative difference of two numbers that may come from another processor.
ROUNDING = 1e-9
SOURCE = 'log'


def world_record(world: World) -> dict[str, Any]:
    """What the names in the entries of a log mean."""
    return {
        'label': world.label,
        'states': [state.name for state in world.states],
        'out_of_reach': [state.name for state in world.states if state in world.out_of_reach],
        'actions': [[a.name, a.manner.name, a.target.name] for a in world.actions],
        'objects': list(world.objects),
    }


def recorded_world(record: Mapping[str, Any]) -> World:
    """A world of the recorded names; its geometry, looks and weights are the default's.

    Raises:
        KeyError, ValueError, TypeError: the record is incomplete.
    """
    default = load_world()
    states = {name: State(number, name) for number, name in enumerate(record['states'])}
    entries = tuple(
        replace(
            default.region_entries[0], state=state, reachable=name not in record['out_of_reach']
        )
        for name, state in states.items()
    )
    actions = tuple(
        Action(number, name, Manner[manner], states[target])
        for number, (name, manner, target) in enumerate(record['actions'])
    )
    objects = tuple(replace(default.object_entries[0], name=name) for name in record['objects'])
    return replace(default, region_entries=entries, actions=actions, object_entries=objects)


def decision_record(
    session: ImitationSession, decision: Decision, demonstration: Demonstration | None = None
) -> dict[str, Any]:
    """The record of the decision that a session has just made.

    demonstration: that it is about, if the session did not take it up.
    """
    here, settings = session.state, session.settings
    model = session.model
    objects = list(model.objects) if settings.shared_prior else [decision.object]
    return {
        'decision': to_json(decision),
        'demonstration': to_json(demonstration or here.demonstration),
        'view': to_json(here.latest),
        'spent': here.spent - (decision.kind is Kind.EXECUTE),
        'settings': {
            field.name: to_json(getattr(settings, field.name))
            for field in fields(settings)
            if field.name != 'world'
        },
        'model': {
            'name': model.name,
            'version': model.version,
            # [x_i, a, x_f] of each object; a list, as their order matters to the last digit.
            'counts': [
                [name, model.objects[name].counts.tolist()]
                for name in objects
                if name in model.objects
            ],
        },
    }


class Inputs(NamedTuple):
    """What a decision is made from."""

    model: RobotModel
    settings: ImitationSettings
    demonstration: Demonstration
    view: TableSnapshot | None
    spent: int


def recorded_inputs(record: Mapping[str, Any], world: World) -> Inputs:
    """What the decision of a record was made from.

    Raises:
        KeyError, ValueError, TypeError: the record is incomplete.
    """
    given = dict(record['settings'])
    mode, policy = Mode[given.pop('mode')], Policy[given.pop('policy')]
    settings = ImitationSettings(world=world, mode=mode, policy=policy, **given)
    model = record['model']
    rows = tuple(
        TrialCounts(name, x_i, action, tuple(row), SOURCE)
        for name, counts in model['counts']
        for x_i, actions in enumerate(counts)
        for action, row in enumerate(actions)
    )
    return Inputs(
        RobotModel(
            model['name'], model['version'], {SOURCE: 'decision log'}, rows, domain_of(world)
        ),
        settings,
        from_json(Demonstration, record['demonstration'], world),
        None if record['view'] is None else from_json(TableSnapshot, record['view'], world),
        int(record['spent']),
    )


def rederive(record: Mapping[str, Any], world: World) -> list[str]:
    """Make a recorded decision again; a sentence for each field that differs, none: the same.

    Raises:
        KeyError, ValueError, TypeError: the record is incomplete.
    """
    inputs = recorded_inputs(record, world)
    written = record['decision']
    again = to_json(_decided(inputs, written['id']))
    return [
        f'{name}: the log says {written.get(name)!r}, it follows {again.get(name)!r}.'
        for name in sorted(set(written) | set(again))
        if not _same(written.get(name), again.get(name))
    ]


def _decided(inputs: Inputs, number: int) -> Decision:
    model, settings, demo, view, spent = inputs
    if not can_infer(model, settings, demo.object):
        return no_trials(model, settings, demo, number)
    if view is None:
        raise ValueError('Expected a table state, got none.')
    return decide(model, settings, demo, view, number, spent)


def _same(one: Any, other: Any) -> bool:
    """Equality up to rounding on another processor."""
    if isinstance(one, list) and isinstance(other, list):
        return len(one) == len(other) and all(map(_same, one, other))
    if isinstance(one, float) and isinstance(other, float):
        return math.isclose(one, other, rel_tol=ROUNDING, abs_tol=ROUNDING)
    return bool(one == other)

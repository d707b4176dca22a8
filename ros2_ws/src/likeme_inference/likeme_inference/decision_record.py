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
from likeme_inference.tabletop.asking import Asking
from likeme_inference.tabletop.domain import Policy, domain_of
from likeme_inference.tabletop.imitation import (
    Goals,
    ImitationSettings,
    can_infer,
    decide,
    no_trials,
)
from likeme_inference.tabletop.prior import Prior
from likeme_inference.tabletop.robot_model import RobotModel, TrialCounts
from likeme_inference.tabletop.session import ImitationSession
from likeme_inference.tabletop.values import BlockedAction, Decision
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
    here, settings = session.state, session.deciding_settings
    model = session.model
    # A promise by relative frequencies is by what is shared, too.
    alone = settings.prior is Prior.OWN and settings.asking is not Asking.PROMISE
    objects = [decision.object] if alone else list(model.objects)
    return {
        'decision': to_json(decision),
        'demonstration': to_json(demonstration or here.demonstration),
        'view': to_json(here.latest),
        'spent': here.spent - (decision.kind is Kind.EXECUTE),
        'blocked': to_json(here.blocked),
        'given': list(session.given),
        'also': to_json(decision.also),
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
    blocked: tuple[BlockedAction, ...] = ()
    given: tuple[float, ...] = ()
    also: tuple[tuple[str, State], ...] | None = None


def recorded_inputs(record: Mapping[str, Any], world: World) -> Inputs:
    """What the decision of a record was made from.

    Raises:
        KeyError, ValueError, TypeError: the record is incomplete.
    """
    given = dict(record['settings'])
    mode, policy = Mode[given.pop('mode')], Policy[given.pop('policy')]
    # Older records have no joint goals.
    given['goals'] = Goals[given.pop('goals', 'OBJECT')]
    given |= {'prior': _recorded_prior(given), 'asking': Asking[given.pop('asking', 'THRESHOLD')]}
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
        # Older records lack these.
        tuple(from_json(BlockedAction, each, world) for each in record.get('blocked', ())),
        tuple(record.get('given', ())),
        None
        if record.get('also') is None
        else tuple((name, world.state(goal)) for name, goal in record['also']),
    )


def _recorded_prior(given: dict[str, Any]) -> Prior:
    """Take the prior out of settings; older records say `shared_prior`."""
    if 'shared_prior' in given:
        return Prior.SHARED if given.pop('shared_prior') else Prior.OWN
    return Prior[given.pop('prior')]


def rederive(record: Mapping[str, Any], world: World) -> list[str]:
    """Make a recorded decision again; a sentence for each field that differs, none: the same.

    Raises:
        KeyError, ValueError, TypeError: the record is incomplete.
    """
    inputs = recorded_inputs(record, world)
    written = record['decision']
    again = to_json(decided(inputs, written['id']))
    return [
        f'{name}: the log says {written.get(name)!r}, it follows {again.get(name)!r}.'
        for name in sorted(set(written) | set(again))
        if not _same(written.get(name), again.get(name))
    ]


def decided(inputs: Inputs, number: int) -> Decision:
    """The decision that follows.

    Raises:
        ValueError: it cannot be made, e.g. as no action copies what was shown.
    """
    model, settings, demo, view, spent, blocked, given, also = inputs
    if not can_infer(model, settings, demo.object):
        return no_trials(model, settings, demo, number)
    if view is None:
        raise ValueError('Expected a table state, got none.')
    made = decide(model, settings, demo, view, number, spent, blocked, given)
    return made if also is None else replace(made, also=also)


def _same(one: Any, other: Any) -> bool:
    """Equality up to rounding on another processor."""
    if isinstance(one, list) and isinstance(other, list):
        return len(one) == len(other) and all(map(_same, one, other))
    if isinstance(one, float) and isinstance(other, float):
        return math.isclose(one, other, rel_tol=ROUNDING, abs_tol=ROUNDING)
    return bool(one == other)

"""Goals over the whole table, and Meltzoff's failed-attempt experiment (beyond the paper)."""

from __future__ import annotations

from typing import Any

from likeme_core.world import World
from likeme_experiments.evaluation.failed_attempt import (
    TRIES,
    Agent,
    FailedAttempt,
    Group,
    failed_attempt,
)
from likeme_experiments.evaluation.joint_goals import (
    Accuracy,
    accuracy_of,
    watched,
)
from likeme_experiments.evaluation.people import Kind
from likeme_experiments.reproductions import joint_goals_figure as figures
from likeme_experiments.reproductions.models import model_of
from likeme_experiments.reproductions.report import (
    Reproduction,
    ReproductionOptions,
    ReproductionReport,
)
from likeme_experiments.reproductions.text_table import aligned, paragraph
from likeme_inference.tabletop.joint_goals import learned_transitions

#: People of each kind, demonstrations of each, and their seed.
PEOPLE, EACH, SEED = 40, 6, 0


def report_joint(options: ReproductionOptions) -> ReproductionReport:
    """How often the joint goal is inferred right, by kind of people."""
    model, world = model_of(options), options.world
    transitions, people = learned_transitions(world, model), options.seeds or PEOPLE
    found: dict[Kind, tuple[Accuracy, Accuracy]] = {}
    for kind in Kind:
        if kind is not Kind.AIMLESS:
            moments = watched(kind, world, transitions, people, EACH, SEED)
            found[kind] = (
                accuracy_of([m for m in moments if m.at_part]),
                accuracy_of([m for m in moments if m.stopped]),
            )
    document = {
        'model': model.label,
        'people': people,
        'demonstrations_each': EACH,
        'rows': [
            {'people': kind.value, 'moment': when, **accuracy._asdict()}
            for kind, both in found.items()
            for when, accuracy in zip(('3/4', 'stop'), both, strict=True)
        ],
    }
    return ReproductionReport(
        document, _joint_text(model.label, found), lambda: figures.joint(found)
    )


def _joint_text(label: str, found: dict[Kind, tuple[Accuracy, Accuracy]]) -> str:
    table = [['people', 'n', 'at 3/4', 'told', 'act by act', 'stopped', 'told', 'act by act']]
    for kind, both in found.items():
        cells = [f'{value:.3f}' for accuracy in both for value in accuracy[1:]]
        table.append([kind.value, str(both[0].n), *cells])
    about = (
        f'Goals over the whole table by {label}: share of demonstrations of simulated people '
        'whose goal is inferred right, after 3/4 of the acts and after the stop. Told: by an '
        'observer who is told the rationality and skill of the person. Act by act: each goal '
        'from the last change of its object alone (Fig 3d). The paper has no goals over the whole '
        'table.'
    )
    return '\n'.join([paragraph(about), *aligned(table, left=1)])


def report_failed_attempt(options: ReproductionOptions) -> ReproductionReport:
    """Meltzoff's failed-attempt experiment."""
    model, world = model_of(options), options.world
    result = failed_attempt(world, learned_transitions(world, model))
    document: dict[str, Any] = {
        'model': model.label,
        'tries': TRIES,
        'cases': result.cases,
        'rows': [
            {
                'group': group.value,
                'success': {agent.name.lower(): p for agent, p in result.success[group].items()},
                'belief': result.belief[group].tolist(),
            }
            for group in Group
        ],
    }
    return ReproductionReport(
        document,
        _failed_attempt_text(model.label, world, result),
        lambda: figures.failed_attempt(result),
    )


def _failed_attempt_text(label: str, world: World, result: FailedAttempt) -> str:
    table = [['shown', *Agent, 'P(goal)']]
    for group in Group:
        cells = [f'{result.success[group][agent]:.3f}' for agent in Agent]
        table.append([group.value, *cells, f'{result.belief[group][-1]:.3f}'])
    about = (
        f'A failed attempt (Meltzoff 1995) by {label} in {world.name}: P(the object is brought to '
        'the state that was meant) by agents that saw it reached (target), tried in vain '
        f'{TRIES} times (attempt), or handled otherwise (control); {result.cases} demonstrations '
        'of each. P(goal): of that state, when the person has stopped. Infants acted alike after '
        'target and attempt, and less after other handling; the paper cites it without numbers.'
    )
    return '\n'.join([paragraph(about), *aligned(table, left=1)])


REPRODUCTIONS = {
    'joint': Reproduction(
        'Goals over the whole table (beyond the paper)',
        report_joint,
        frozenset({'world', 'model', 'workers', 'seeds'}),
    ),
    'failed_attempt': Reproduction(
        'A person who tries and fails (Meltzoff 1995)',
        report_failed_attempt,
        frozenset({'world', 'model', 'workers'}),
    ),
}

"""Robot models computed from the trials in an experience store."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby

from likeme_core.world import World
from likeme_inference.experience.store import EndStateCount, ExperienceStore
from likeme_inference.tabletop.domain import domain_of
from likeme_inference.tabletop.robot_model import RobotModel, TrialCounts


def robot_model(
    store: ExperienceStore,
    name: str = 'self_experience',
    robots: Sequence[str] = (),
    campaigns: Sequence[str] = (),
) -> RobotModel:
    """The model of the recorded trials; of all robots and campaigns unless named."""
    tallies = store.tallies(robots, campaigns)
    return model_of_rows(name, rows_of(tallies, store.world), store.world)


def rows_of(tallies: Sequence[EndStateCount], world: World) -> tuple[TrialCounts, ...]:
    """Rows of counts, one per pair and source."""
    return tuple(
        TrialCounts(pair.object, pair.x_i, pair.action, _ends(list(group), world), source)
        for (source, pair), group in groupby(tallies, lambda t: (source_of(t), t.pair))
    )


def source_of(tally: EndStateCount) -> str:
    """The source key of a robot's campaign."""
    return f'{tally.robot}/{tally.campaign}'


def model_of_rows(name: str, rows: Sequence[TrialCounts], world: World) -> RobotModel:
    """A model of rows whose sources are campaigns; its version is the number of trials."""
    trials = sum(sum(row.counts) for row in rows)
    sources = {row.source: _sentence(row.source) for row in rows}
    # A model file needs at least one source.
    sources = sources or {'none': 'No trial yet.'}
    return RobotModel(name, str(trials), sources, tuple(rows), domain_of(world))


def _ends(group: Sequence[EndStateCount], world: World) -> tuple[int, ...]:
    found = {tally.x_f: tally.trials for tally in group}
    return tuple(found.get(state, 0) for state in world.states)


def _sentence(source: str) -> str:
    robot, _, campaign = source.partition('/')
    return f'Trials of the robot {robot} in the campaign {campaign}.'

"""The robot's transition model as a view of its experience: counts by source, never kept apart."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby

from likeme_core.tabletop import State
from likeme_inference.experience.store import ExperienceStore, Tally
from likeme_inference.tabletop.robot_model import RobotModel, TrialCounts


def robot_model(
    store: ExperienceStore,
    name: str = 'self_experience',
    robots: Sequence[str] = (),
    campaigns: Sequence[str] = (),
) -> RobotModel:
    """The model that follows from trials: of all robots and campaigns unless they are named."""
    tallies = store.tallies(robots, campaigns)
    return model_of_rows(name, rows_of(tallies))


def rows_of(tallies: Sequence[Tally]) -> tuple[TrialCounts, ...]:
    """Rows of counts, one for each pair of each source."""
    return tuple(
        TrialCounts(pair.object, pair.x_i, pair.action, _ends(list(group)), source)
        for (source, pair), group in groupby(tallies, lambda t: (source_of(t), t.pair))
    )


def source_of(tally: Tally) -> str:
    """The key of a robot's campaign among a model's sources."""
    return f'{tally.robot}/{tally.campaign}'


def model_of_rows(name: str, rows: Sequence[TrialCounts]) -> RobotModel:
    """A model of rows whose sources are campaigns; its version is how many trials it holds."""
    trials = sum(sum(row.counts) for row in rows)
    sources = {row.source: _sentence(row.source) for row in rows}
    # A model file has at least one source.
    return RobotModel(name, str(trials), sources or {'none': 'No trial yet.'}, tuple(rows))


def _ends(group: Sequence[Tally]) -> tuple[int, ...]:
    found = {tally.x_f: tally.trials for tally in group}
    return tuple(found.get(state, 0) for state in State)


def _sentence(source: str) -> str:
    robot, _, campaign = source.partition('/')
    return f'Trials of the robot {robot} in the campaign {campaign}.'

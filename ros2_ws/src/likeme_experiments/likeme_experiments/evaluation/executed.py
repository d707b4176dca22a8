"""Scores of executed imitations: Table 1 as observed by the camera, beside the model's forecast.

An episode is one demonstration and its imitation in every mode. An imitation succeeds when the
object comes to rest in the demonstrated state.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from typing import NamedTuple, TypeVar

import numpy as np

from likeme_core.tabletop import Action, Mode, State
from likeme_core.world import World
from likeme_experiments.evaluation.episode import ImitationEpisode, ImitationResult
from likeme_experiments.evaluation.forecast import Approach, DemonstrationCase, Forecast
from likeme_experiments.evaluation.intervals import (
    ProportionInterval,
    calibration_error,
    exact_interval,
    predictive_interval,
)

Forecasts = Mapping[tuple[DemonstrationCase, Approach], Forecast]


class ApproachScore(NamedTuple):
    """Some imitations of one approach.

    Attributes:
        successes, tries: how many reached the goal, of how many.
        bounds: of the success probability (Clopper and Pearson, 95 %).
        predicted: predicted success, mean over tries.
        helped: proportion in which the robot asked.
        predicted_help: predicted proportion of the same.
    """

    successes: int
    tries: int
    bounds: ProportionInterval
    predicted: float
    helped: float
    predicted_help: float

    @property
    def success(self) -> float:
        """Proportion that reached the goal."""
        return self.successes / self.tries


class IntervalCheck(NamedTuple):
    """Score of one case and approach, and the model's predictive interval for as many tries."""

    case: DemonstrationCase
    approach: Approach
    score: ApproachScore
    expected: ProportionInterval
    asks: bool

    @property
    def inside(self) -> bool:
        """Whether the executed success lies in the interval."""
        return self.expected.holds(self.score.success)


class Reliability(NamedTuple):
    """Predicted and achieved success of first actions, by object, change and action."""

    object: str
    x_i: State
    x_f: State
    action: Action
    predicted: float
    successes: int
    tries: int


def score(
    episodes: Sequence[ImitationEpisode], estimate: str, approach: Approach, expected: Forecasts
) -> ApproachScore:
    """Score of one approach in some episodes.

    Raises:
        ValueError: no episode.
    """
    reached, asked = 0, 0
    for episode in episodes:
        result = episode.results[estimate].get(approach.mode)
        reached += result is not None and result.reached(episode.case.x_f, approach)
        asked += result is not None and result.asked
    tries, known = len(episodes), [expected[episode.case, approach] for episode in episodes]
    return ApproachScore(
        reached, tries, exact_interval(reached, tries),
        float(np.mean([f.success for f in known])), asked / tries,
        float(np.mean([f.help_rate for f in known])),
    )  # fmt: skip


K = TypeVar('K', bound=Hashable)


def grouped(
    episodes: Iterable[ImitationEpisode], key: Callable[[ImitationEpisode], K]
) -> dict[K, tuple[ImitationEpisode, ...]]:
    """Episodes by key, in order of first occurrence."""
    groups: dict[K, list[ImitationEpisode]] = defaultdict(list)
    for episode in episodes:
        groups[key(episode)].append(episode)
    return {name: tuple(group) for name, group in groups.items()}


def interval_checks(
    episodes: Sequence[ImitationEpisode], estimate: str, expected: Forecasts
) -> list[IntervalCheck]:
    """Every case and approach but SEQUENTIAL_WITH_HELP, which cannot fail."""
    found = []
    for case, group in grouped(episodes, lambda e: e.case).items():
        for approach in (a for a in Approach if a is not Approach.SEQUENTIAL_WITH_HELP):
            known = expected[case, approach]
            interval = predictive_interval(known.worlds, len(group))
            done = score(group, estimate, approach, expected)
            asks = approach.helped and known.help_rate == 1.0
            found.append(IntervalCheck(case, approach, done, interval, asks))
    return found


def reliability(
    episodes: Iterable[ImitationEpisode],
    estimate: str,
    predicted: Callable[[str, int, int, int], float],
    world: World,
) -> list[Reliability]:
    """First actions by object, change and action; one that several modes chose counts once.

    predicted: (object, x_i, action, x_f) -> the model's probability.
    """
    counts: dict[tuple[str, State, State, int], list[int]] = defaultdict(lambda: [0, 0])
    for episode in episodes:
        name, x_i, x_f, _ = episode.case
        results = episode.results[estimate].values()
        first = {r.actions[0]: r.states[0] for r in results if r.actions}
        for action, state in first.items():
            counts[name, x_i, x_f, action][0] += state == x_f
            counts[name, x_i, x_f, action][1] += 1
    return [
        Reliability(name, x_i, x_f, world.actions[a], predicted(name, x_i, a, x_f), done, tries)
        for (name, x_i, x_f, a), (done, tries) in sorted(counts.items())
    ]


def later_actions(
    episodes: Iterable[ImitationEpisode],
    estimate: str,
    predicted: Callable[[str, int, int, int], float],
) -> tuple[float, float, int]:
    """Second and third actions: success predicted, achieved (mean), and how many there were.

    They start where the previous action left the object.
    """
    predictions: list[float] = []
    reached = 0
    for episode in episodes:
        result = episode.results[estimate].get(Mode.SEQUENTIAL)
        for before, a, after in _later(result) if result else ():
            predictions.append(predicted(episode.case.object, before, a, episode.case.x_f))
            reached += after == episode.case.x_f
    return (
        float(np.mean(predictions)) if predictions else 0.0,
        reached / max(len(predictions), 1),
        len(predictions),
    )


def _later(result: ImitationResult) -> list[tuple[int, int, int | None]]:
    moves = zip(result.states, result.actions[1:], result.states[1:], strict=False)
    return [(before, a, after) for before, a, after in moves if before is not None]


def calibration_error_of(cells: Sequence[Reliability]) -> float:
    """Expected calibration error of first actions."""
    return calibration_error(
        [c.predicted for c in cells], [c.successes / c.tries for c in cells],
        [c.tries for c in cells],
    )  # fmt: skip


class Difference(NamedTuple):
    """Difference in success of two approaches, with its standard error."""

    mean: float
    error: float


def difference(
    episodes: Sequence[ImitationEpisode], estimate: str, more: Approach, less: Approach
) -> Difference:
    """Paired comparison of two approaches, which start each episode with the same seed."""
    scores = np.array(
        [
            [
                (result := e.results[estimate].get(approach.mode)) is not None
                and result.reached(e.case.x_f, approach)
                for approach in (more, less)
            ]
            for e in episodes
        ],
        dtype=np.float64,
    )
    gain = scores[:, 0] - scores[:, 1]
    return Difference(float(gain.mean()), float(gain.std() / np.sqrt(len(gain))))

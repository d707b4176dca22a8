"""Imitations that were really carried out, counted: Table 1 as the camera saw it.

An episode is one demonstration and what came of it in every mode. Success is that the object rests
in the state that the person meant to show; the model's forecast of the same stands beside it.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from typing import NamedTuple, TypeVar

import numpy as np

from likeme_core.tabletop import Action, Mode, State
from likeme_experiments.evaluation.episode import Ending, Episode
from likeme_experiments.evaluation.forecast import Case, Forecast, Way
from likeme_experiments.evaluation.intervals import (
    Interval,
    calibration_error,
    exact_interval,
    predictive_interval,
)

Forecasts = Mapping[tuple[Case, Way], Forecast]


class Score(NamedTuple):
    """Some imitations of one way.

    Attributes:
        successes, tries: how many reached the goal, of how many.
        bounds: of the probability behind them (Clopper and Pearson, 95 %).
        predicted: success the model predicted, mean over tries.
        helped: share in which it asked.
        predicted_help: share in which the model expected to ask.
    """

    successes: int
    tries: int
    bounds: Interval
    predicted: float
    helped: float
    predicted_help: float

    @property
    def success(self) -> float:
        """Share that reached the goal."""
        return self.successes / self.tries


class Checked(NamedTuple):
    """One case in one way held against the model's own interval for so many tries."""

    case: Case
    way: Way
    score: Score
    expected: Interval
    asks: bool

    @property
    def inside(self) -> bool:
        """Whether the executed success lies where the model expected it."""
        return self.expected.holds(self.score.success)


class Reliability(NamedTuple):
    """Predicted against achieved for one action on one object and change, from a fresh start."""

    object: str
    x_i: State
    x_f: State
    action: Action
    predicted: float
    successes: int
    tries: int


def score(episodes: Sequence[Episode], estimate: str, way: Way, expected: Forecasts) -> Score:
    """Count how one way did in some episodes.

    Raises:
        ValueError: no episode.
    """
    reached, asked = 0, 0
    for episode in episodes:
        ending = episode.endings[estimate].get(way.mode)
        reached += ending is not None and ending.reached(episode.case.x_f, way)
        asked += ending is not None and ending.asked
    tries, known = len(episodes), [expected[episode.case, way] for episode in episodes]
    return Score(
        reached, tries, exact_interval(reached, tries),
        float(np.mean([f.success for f in known])), asked / tries,
        float(np.mean([f.help_rate for f in known])),
    )  # fmt: skip


K = TypeVar('K', bound=Hashable)


def grouped(
    episodes: Iterable[Episode], key: Callable[[Episode], K]
) -> dict[K, tuple[Episode, ...]]:
    """Episodes by some key, in order of first mention."""
    groups: dict[K, list[Episode]] = defaultdict(list)
    for episode in episodes:
        groups[key(episode)].append(episode)
    return {name: tuple(group) for name, group in groups.items()}


def checked(episodes: Sequence[Episode], estimate: str, expected: Forecasts) -> list[Checked]:
    """Every case in every way but the one that cannot fail, against the model's interval."""
    found = []
    for case, group in grouped(episodes, lambda e: e.case).items():
        for way in (w for w in Way if w is not Way.SEQUENTIAL_WITH_HELP):
            known = expected[case, way]
            interval = predictive_interval(known.worlds, len(group))
            done = score(group, estimate, way, expected)
            asks = way.helped and known.help_rate == 1.0
            found.append(Checked(case, way, done, interval, asks))
    return found


def reliability(
    episodes: Iterable[Episode], estimate: str, predicted: Callable[[str, int, int, int], float]
) -> list[Reliability]:
    """First actions by object, change and action; one that several modes took counts once.

    predicted: (object, x_i, action, x_f) -> the model's probability.
    """
    counts: dict[tuple[str, State, State, int], list[int]] = defaultdict(lambda: [0, 0])
    for episode in episodes:
        name, x_i, x_f, _ = episode.case
        endings = episode.endings[estimate].values()
        first = {e.actions[0]: e.states[0] for e in endings if e.actions}
        for action, state in first.items():
            counts[name, x_i, x_f, action][0] += state == x_f
            counts[name, x_i, x_f, action][1] += 1
    return [
        Reliability(name, x_i, x_f, Action(a), predicted(name, x_i, a, x_f), done, tries)
        for (name, x_i, x_f, a), (done, tries) in sorted(counts.items())
    ]


def later_actions(
    episodes: Iterable[Episode], estimate: str, predicted: Callable[[str, int, int, int], float]
) -> tuple[float, float, int]:
    """Second and third actions: success predicted, achieved (mean), and how many there were.

    They start where the one before left the object, not where a trial begins.
    """
    hopes: list[float] = []
    reached = 0
    for episode in episodes:
        ending = episode.endings[estimate].get(Mode.SEQUENTIAL)
        for before, a, after in _later(ending) if ending else ():
            hopes.append(predicted(episode.case.object, before, a, episode.case.x_f))
            reached += after == episode.case.x_f
    return float(np.mean(hopes)) if hopes else 0.0, reached / max(len(hopes), 1), len(hopes)


def _later(ending: Ending) -> list[tuple[int, int, int | None]]:
    moves = zip(ending.states, ending.actions[1:], ending.states[1:], strict=False)
    return [(before, a, after) for before, a, after in moves if before is not None]


def error_of(cells: Sequence[Reliability]) -> float:
    """Expected calibration error of actions from a fresh start."""
    return calibration_error(
        [c.predicted for c in cells], [c.successes / c.tries for c in cells],
        [c.tries for c in cells],
    )  # fmt: skip


class Difference(NamedTuple):
    """How much more often one way reached the goal than another, with its standard error."""

    mean: float
    error: float


def difference(episodes: Sequence[Episode], estimate: str, more: Way, less: Way) -> Difference:
    """Compare two ways on the same episodes, which they began with the same chance."""
    scores = np.array(
        [
            [
                (ending := e.endings[estimate].get(way.mode)) is not None
                and ending.reached(e.case.x_f, way)
                for way in (more, less)
            ]
            for e in episodes
        ],
        dtype=np.float64,
    )
    gain = scores[:, 0] - scores[:, 1]
    return Difference(float(gain.mean()), float(gain.std() / np.sqrt(len(gain))))

"""A promised rate of success, kept by asking: at the start by the model, then by what happens.

The robot acts if the predicted success of its action is at least a threshold and else asks a
person, whose help counts as success. It promises that the goal is reached in a share `target` of
all episodes, 1 - alpha.

At the start the threshold is set so that the model predicts just that (`asking_probabilities`).
Then, after each episode whose end is known, missed = 1 if the robot acted and the goal was not
reached,

    threshold <- threshold + step / q (missed - alpha),

and where it is not certain which goal was meant, the probability that it was not reached. q is
the probability that the end is known. With q = 1 this is the adaptive conformal inference of
Gibbs and Candes (NeurIPS 2021), else the intermittent quantile tracking of Zhao, Simmons, Admoni,
Ramdas and Bajcsy (2024): whatever the world does, the mean of `missed` over T episodes is within
(range of the threshold) / (step T) of alpha, in expectation over which ends are known.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from likeme_inference.tabletop.arrays import FloatArray
from likeme_inference.tabletop.goal_inference import TIE

#: Default step; see the benchmark `judgement` for how soon it follows a change.
STEP = 0.1
#: Episodes that are told of.
WINDOW = 50


@dataclass(frozen=True)
class Promise:
    """The state of a promise.

    Attributes:
        target: promised share of episodes in which the goal is reached, by robot or person.
        threshold: of predicted success, below which the robot asks; below 0 it never does, above
            1 always.
        step: see the module.
        recent: probability that the goal was reached, in each of the last WINDOW episodes with a
            known end.
    """

    target: float
    threshold: float
    step: float = STEP
    recent: tuple[float, ...] = ()

    def asks(self, predicted_success: float) -> bool:
        """Whether the robot asks rather than acts."""
        return predicted_success < self.threshold - TIE

    def after(self, acted: bool, reached: float | None, known: float = 1.0) -> Promise:
        """The promise after an episode.

        Args:
            acted: whether the robot acted, rather than asked.
            reached: probability that the goal was reached then, 0 or 1 where the goal is known;
                None: its end was not seen. Ignored if it asked.
            known: probability that the end of an episode in which it acts is seen.

        Raises:
            ValueError: a probability that is not above 0 up to 1.
        """
        if not 0 < known <= 1:
            raise ValueError(f'Expected a probability above 0 up to 1, got {known:g}.')
        if acted and reached is None:
            return self
        missed = 0.0 if reached is None or not acted else 1.0 - reached
        weight = known if acted else 1.0
        return replace(
            self,
            threshold=self.threshold + self.step / weight * (missed - (1 - self.target)),
            recent=(*self.recent, 1.0 - missed)[-WINDOW:],
        )

    @property
    def kept(self) -> float:
        """Mean of `recent`, the share in which the goal was reached; NaN without any."""
        return sum(self.recent) / len(self.recent) if self.recent else math.nan

    @property
    def sentence(self) -> str:
        """Promised and kept, for a person."""
        if not self.recent:
            return f'promised {self.target:.0%}, nothing tried yet'
        return f'promised {self.target:.0%}, kept {self.kept:.0%} of the last {len(self.recent)}'


def promise(predicted: ArrayLike, target: float, step: float = STEP) -> Promise:
    """A promise whose threshold lets the predicted success of the episodes meet the target.

    predicted: success of the best action in each episode that may come, all as likely, shape [n].

    Raises:
        ValueError: see `asking_probabilities`.
    """
    successes = np.asarray(predicted, dtype=np.float64)
    asked = asking_probabilities(successes, target)
    if not asked.any():
        # Below all: as the target is met, nothing is asked before something was missed.
        return Promise(target, float(successes.min()), step)
    if asked.all():
        return Promise(target, float(successes.max()) + 2 * TIE, step)
    return Promise(target, float(successes[asked < 1].min()), step)


def asking_probabilities(predicted: ArrayLike, target: float) -> FloatArray:
    """How likely to ask in each episode, so that on average the predicted success is `target`.

    Of all ways to meet it the one with the least help: from the least success up, the last of them
    by chance. Episodes of the same success are asked about with the same probability.

    Args:
        predicted: success of the best action in each of the equally likely episodes, shape [n].
        target: share of success, help included.

    Raises:
        ValueError: no episodes, or numbers that are no probabilities.
    """
    successes = np.asarray(predicted, dtype=np.float64)
    proper = successes.ndim == 1 and len(successes) and ((successes >= 0) & (successes <= 1)).all()
    if not proper or not 0 <= target <= 1:
        raise ValueError(f'Expected probabilities, got {successes.tolist()} and {target:g}.')
    asked, short = np.zeros(len(successes)), target * len(successes) - successes.sum()
    for success in np.unique(successes):
        alike = successes == success
        gain = float((1 - success) * alike.sum())
        if short <= 0 or gain <= 0:
            break
        asked[alike] = min(1.0, short / gain)
        short -= gain
    return asked
